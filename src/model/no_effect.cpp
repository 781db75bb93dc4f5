// The table, and the walk over a document.
#include "model/no_effect.h"

#include <charconv>
#include <string>
#include <string_view>

namespace ruedo::model {
namespace {

struct NoEffect {
  std::string_view path;  // the end of an element's path
  std::string_view
      usual;  // values that ask for nothing, with '|' between them; "": its presence does
  const char* text;
};

constexpr const char* kSky = "the sky is a gradient without clouds, whatever its time";
constexpr const char* kMaps = "of the maps of a material only the albedo is shown";
constexpr const char* kSeesAll = "every camera sees every visual";
constexpr const char* kStops = "a joint's stops are stiff";

constexpr NoEffect kTable[] = {
    {"scene/sky/clouds", "", kSky},
    {"scene/sky/time", "10", kSky},
    {"scene/sky/sunrise", "6", kSky},
    {"scene/sky/sunset", "20", kSky},
    {"scene/sky/cubemap_uri", "", kSky},
    {"visual/laser_retro", "0", "intensities are those of collisions: <ruedo:laser_reflectance>"},
    {"visual/visibility_flags", "4294967295", kSeesAll},
    {"camera/visibility_mask", "4294967295", kSeesAll},
    {"ray/visibility_mask", "4294967295", "rays see every shape"},
    {"lidar/visibility_mask", "4294967295", "rays see every shape"},
    {"surface/soft_contact", "", "nothing is soft"},
    {"torsional/ode/slip", "0", "friction that turning meets does not slip"},
    {"bounce/threshold", "100000|0", "what bounces, bounces at any speed"},
    {"axis/limit/stiffness", "100000000", kStops},
    {"axis/limit/dissipation", "1", kStops},
    {"axis2/limit/stiffness", "100000000", kStops},
    {"axis2/limit/dissipation", "1", kStops},
    {"script/auto_start", "true|1", "the actor walks from the start"},
    {"camera/triggered", "false|0", "pictures come at the camera's rate"},
    {"camera/trigger_topic", "", "pictures come at the camera's rate"},
    {"camera/save", "", "pictures are not written to files; `ruedo export` does that"},
    {"metal/normal_map", "", kMaps},
    {"metal/roughness_map", "", kMaps},
    {"metal/metalness_map", "", kMaps},
    {"metal/environment_map", "", kMaps},
    {"metal/ambient_occlusion_map", "", kMaps},
    {"metal/light_map", "", kMaps},
    {"metal/emissive_map", "", kMaps},
    {"specular/normal_map", "", kMaps},
    {"specular/specular_map", "", kMaps},
    {"specular/glossiness_map", "", kMaps},
    {"specular/environment_map", "", kMaps},
    {"material/lighting", "true|1", "every material is lit"},
    {"orientation_reference_frame/localization", "CUSTOM|ENU",
     "the orientation is that in the world's axes"},
    {"orientation_reference_frame/custom_rpy", "0 0 0",
     "the orientation is that in the world's axes"},
    {"include/enable_wind", "false|0", "the included model says what feels the wind"},
};

bool ends_with_path(std::string_view path, std::string_view end) {
  return path.ends_with(end) &&
         (path.size() == end.size() || path[path.size() - end.size() - 1] == '/');
}

bool same_number(std::string_view a, std::string_view b) {
  double x = 0, y = 0;
  const auto read = [](std::string_view text, double& value) {
    const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
    return fault == std::errc() && end == text.data() + text.size();
  };
  return read(a, x) && read(b, y) && x == y;
}

bool is_usual(const Element& element, std::string_view usual) {
  const std::string* enabled = element.attribute("enabled");
  if (enabled && (*enabled == "false" || *enabled == "0")) return true;
  while (!usual.empty()) {
    const std::string_view one = usual.substr(0, usual.find('|'));
    if (element.text == one || same_number(element.text, one)) return true;
    usual.remove_prefix(std::min(usual.size(), one.size() + 1));
  }
  return false;
}

struct Walk {
  Findings& findings;

  void below(const Element& element, const std::string& path, const std::string& where) {
    for (const auto& child : element.children) {
      if (child->name.find(':') != std::string::npos || child->name == "plugin") continue;
      const std::string here = path + "/" + child->name;
      for (const NoEffect& each : kTable) {
        if (ends_with_path(here, each.path) && !is_usual(*child, each.usual))
          findings.unsupported(child->source, where,
                               "<" + child->name + "> is not supported: " + each.text);
      }
      const std::string* name = child->attribute("name");
      below(*child, here,
            name ? where + (where.empty() ? "" : "/") + child->name + " " + *name : where);
    }
  }
};

}  // namespace

void name_what_has_no_effect(const Element& sdf, Findings& findings) {
  Walk{findings}.below(sdf, "sdf", "");
}

}  // namespace ruedo::model
