// <plugin filename="gz-sim-label-system"> and "gz-sim-thermal-system".
#include "model/visual_plugins.h"

#include <algorithm>

#include "model/plugins.h"
#include "model/read_context.h"

namespace ruedo::model {
namespace {

struct Seen {
  int label = 0;
  double temperature = 0.0;
};

// What the plugins of one element say; what they leave open stays.
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

}  // namespace

void read_labels_and_temperatures(const Element& model_element, const std::string& where,
                                  Findings& findings, Model& model) {
  const Seen of_model = read(model_element, {}, where, findings);
  for (Link& link : model.links) {
    Seen of_link = of_model;
    const Element* written = nullptr;
    for (const Element* each : model_element.all("link")) {
      const std::string* name = each->attribute("name");
      if (name && dotted(*name) == link.name) written = each;
    }
    const std::string here = where + "/link " + link.name;
    if (written) of_link = read(*written, of_model, here, findings);
    for (Visual& visual : link.visuals) {
      Seen seen = of_link;
      for (const Element* each : written ? written->all("visual") : std::vector<const Element*>()) {
        const std::string* name = each->attribute("name");
        if (name && *name == visual.name)
          seen = read(*each, of_link, here + "/visual " + visual.name, findings);
      }
      if (visual.label == 0) visual.label = seen.label;
      if (visual.temperature == 0.0) visual.temperature = seen.temperature;
    }
  }
}

}  // namespace ruedo::model
