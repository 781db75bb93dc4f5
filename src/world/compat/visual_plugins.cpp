// <plugin filename="gz-sim-label-system"> and "gz-sim-thermal-system".
#include "world/compat/visual_plugins.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <unordered_map>

#include "world/compat/plugins.h"
#include "world/read/read_context.h"

namespace ruedo::world {
namespace {

struct Seen {
  int label = 0;
  double temperature = 0.0;
};

// The values given by one element's plugins; others keep their value.
Seen read(const Element& element, Seen seen, const std::string& where, Findings& findings) {
  const Allowed kelvin = Allowed{.min = 0.0, .max = 10'000.0, .min_excluded = true};
  for (const Element* plugin : element.all("plugin")) {
    read_or_leave_out(where, "it has no effect", findings, [&] {
      const std::string kind = kind_of(*plugin).name;
      if (kind == "Label")
        seen.label =
            static_cast<int>(plugin->integer("label", seen.label, Allowed::between(0, 255)));
      if (kind != "Thermal") return;
      if (const Element* signature = plugin->child("heat_signature")) {
        seen.temperature = (plugin->number("min_temp", 310.0, kelvin) +
                            plugin->number("max_temp", 310.0, kelvin)) /
                           2;
        findings.unsupported(signature->source, where,
                             "<heat_signature> is not supported: the shape has the mean of "
                             "<min_temp> and <max_temp> everywhere");
      } else {
        seen.temperature = plugin->number("temperature", seen.temperature, kelvin);
      }
    });
  }
  return seen;
}

// The children of that kind, by their name in the model; only looked up, never iterated.
std::unordered_map<std::string, const Element*> by_name(const Element& element,
                                                        std::string_view kind) {
  std::unordered_map<std::string, const Element*> found;
  for (const Element* each : element.all(kind)) {
    if (const std::string* name = each->attribute("name")) found[dotted(*name)] = each;
  }
  return found;
}

}  // namespace

void read_labels_and_temperatures(const Element& model_element, const std::string& where,
                                  Findings& findings, Model& model) {
  const Seen of_model = read(model_element, {}, where, findings);
  const auto links = by_name(model_element, "link");
  for (Link& link : model.links) {
    const auto written = links.find(link.name);
    const std::string here = where + "/link " + link.name;
    const Seen of_link =
        written == links.end() ? of_model : read(*written->second, of_model, here, findings);
    const auto visuals = written == links.end() ? std::unordered_map<std::string, const Element*>()
                                                : by_name(*written->second, "visual");
    for (Visual& visual : link.visuals) {
      const auto shown = visuals.find(dotted(visual.name));
      const Seen seen = shown == visuals.end() ? of_link
                                               : read(*shown->second, of_link,
                                                      here + "/visual " + visual.name, findings);
      if (visual.label == 0) visual.label = seen.label;
      if (visual.temperature == 0.0) visual.temperature = seen.temperature;
    }
  }
}

}  // namespace ruedo::world
