// The table, and the walk over a document.
#include "world/read/no_effect.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "world/read/read_context.h"

namespace ruedo::world {
namespace {

struct NoEffect {
  std::string_view path;  // the last parts of an element's path
  std::string_view
      usual;  // values without effect, separated by '|'; "": the element's presence has none
  const char* text;
};

constexpr const char* kSky = "the sky is a gradient without clouds, whatever its time";
constexpr const char* kMaps = "of the maps of a material only the albedo is shown";
constexpr const char* kSeesAll = "every camera sees every visual";
constexpr const char* kStops = "a joint's stops are stiff";
constexpr const char* kBits = "the shape collides with everything";
constexpr const char* kShine = "<specular> and <shininess> say what shines";
constexpr const char* kChannels = "channels begin with the model's name";
constexpr const char* kSecondAxis = "the second axis of a joint follows nothing";
constexpr const char* kInWorld = "the poses of a state are those in the world";
constexpr const char* kFrames = "frames have the names of the devices";
constexpr const char* kElastic = "<kp> and <kd> say how a contact yields";

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
    {"contact/category_bitmask", "65535", kBits},
    {"contact/collide_without_contact_bitmask", "1", kBits},
    {"contact/elastic_modulus", "0", kElastic},
    {"contact/poissons_ratio", "0.3|0", kElastic},
    {"torsional/ode/slip", "0", "torsional friction does not slip"},
    {"bounce/threshold", "100000|0", "bodies bounce at any speed"},
    {"axis/limit/stiffness", "100000000", kStops},
    {"axis/limit/dissipation", "1", kStops},
    {"axis2/mimic", "", kSecondAxis},
    {"axis2/limit/stiffness", "100000000", kStops},
    {"axis2/limit/dissipation", "1", kStops},
    {"script/auto_start", "true|1", "the actor walks from the start"},
    {"camera/triggered", "false|0", "pictures come at the camera's rate"},
    {"camera/trigger_topic", "", "pictures come at the camera's rate"},
    {"lens/projection", "", "camera_info_t has no projection of its own"},
    {"camera/save", "", "pictures are not written to files; `ruedo export` does that"},
    {"metal/metalness", "0.5", kShine},
    {"metal/roughness", "0.5", kShine},
    {"metal/normal_map", "", kMaps},
    {"metal/roughness_map", "", kMaps},
    {"metal/metalness_map", "", kMaps},
    {"metal/environment_map", "", kMaps},
    {"metal/ambient_occlusion_map", "", kMaps},
    {"metal/light_map", "", kMaps},
    {"metal/emissive_map", "", kMaps},
    {"specular/normal_map", "", kMaps},
    {"specular/specular_map", "", kMaps},
    {"specular/glossiness", "0", kShine},
    {"specular/glossiness_map", "", kMaps},
    {"specular/environment_map", "", kMaps},
    {"specular/ambient_occlusion_map", "", kMaps},
    {"specular/light_map", "", kMaps},
    {"specular/emissive_map", "", kMaps},
    {"material/shader", "", "surfaces are lit by <ambient>, <diffuse>, <specular> and <emissive>"},
    {"material/render_order", "0", "nearer surfaces always hide those behind them"},
    {"material/lighting", "true|1", "every material is lit"},
    {"orientation_reference_frame/localization", "CUSTOM|ENU",
     "the orientation is relative to the world's axes"},
    {"orientation_reference_frame/custom_rpy", "0 0 0",
     "the orientation is relative to the world's axes"},
    {"sensor/frame_id", "", kFrames},
    {"sensor/gz_frame_id", "", kFrames},
    {"sensor/ignition_frame_id", "", kFrames},
    {"physics/real_time_factor", "1|0", "`ruedo run --rate` says how fast it goes"},
    {"state/model/pose/@relative_to", "", kInWorld},
    {"state/model/link/pose/@relative_to", "", kInWorld},
    {"state/light/pose/@relative_to", "", kInWorld},
    {"state/model_state/pose/@relative_to", "", kInWorld},
    {"model_state/link_state/pose/@relative_to", "", kInWorld},
    {"state/light_state/pose/@relative_to", "", kInWorld},
    {"world/@namespace", "", kChannels},
    {"model/@namespace", "", kChannels},
};

// The elements that may occur in an element. Unknown ones are reported by the readers.
const std::map<std::string_view, std::string_view>& children_in_sdf() {
  static const std::map<std::string_view, std::string_view> table = {
#include "world/read/sdf_children.inc"
  };
  return table;
}
constexpr std::string_view kReadersName[] = {
    "sdf",          "world",        "model",     "link",         "joint",
    "axis",         "axis2",        "visual",    "surface",      "include",
    "light",        "scene",        "physics",   "inertia",      "material",
    "mesh",         "inertial",     "collision", "heightmap",    "state",
    "geometry",     "air_pressure", "air_speed", "altimeter",    "spherical_coordinates",
    "force_torque", "gps",          "navsat",    "magnetometer", "logical_camera"};

// A sensor of an unknown type belongs to a plugin, and so does its content.
constexpr std::string_view kSensorTypes[] = {"air_pressure",
                                             "air_speed",
                                             "altimeter",
                                             "boundingbox",
                                             "boundingbox_camera",
                                             "camera",
                                             "contact",
                                             "custom",
                                             "depth",
                                             "depth_camera",
                                             "force_torque",
                                             "gps",
                                             "gpu_lidar",
                                             "gpu_ray",
                                             "imu",
                                             "lidar",
                                             "logical_camera",
                                             "magnetometer",
                                             "multicamera",
                                             "navsat",
                                             "none",
                                             "ray",
                                             "rfid",
                                             "rfidtag",
                                             "rgbd",
                                             "rgbd_camera",
                                             "segmentation",
                                             "segmentation_camera",
                                             "sonar",
                                             "thermal",
                                             "thermal_camera",
                                             "wide_angle_camera",
                                             "wideanglecamera",
                                             "wireless_receiver",
                                             "wireless_transmitter"};

// Of each type of sensor, what of <sensor> describes it.
struct OfSensor {
  std::string_view types, elements;
};
constexpr OfSensor kOfSensors[] = {
    {"air_pressure", "air_pressure"},
    {"air_speed", "air_speed"},
    {"altimeter", "altimeter"},
    {"boundingbox boundingbox_camera camera depth depth_camera multicamera rgbd rgbd_camera "
     "segmentation segmentation_camera thermal thermal_camera wide_angle_camera wideanglecamera",
     "camera"},
    {"contact", "contact"},
    {"force_torque", "force_torque"},
    {"gps navsat", "gps navsat"},
    {"gpu_lidar gpu_ray lidar ray", "lidar ray"},
    {"imu", "imu"},
    {"logical_camera", "logical_camera"},
    {"magnetometer", "magnetometer"},
    {"rfid", "rfid"},
    {"rfidtag", "rfidtag"},
    {"sonar", "sonar"},
    {"wireless_receiver wireless_transmitter", "transceiver"},
};

// Elements that may occur more than once in a parent. Of all others the readers use the first.
constexpr std::string_view kSeveral[] = {"actor",
                                         "angle",
                                         "animation",
                                         "audio_sink",
                                         "audio_source",
                                         "battery",
                                         "blend",
                                         "camera",
                                         "collision",
                                         "frame",
                                         "gripper",
                                         "gripper_link",
                                         "include",
                                         "joint",
                                         "joint_state",
                                         "light",
                                         "light_state",
                                         "link",
                                         "link_state",
                                         "model",
                                         "model_state",
                                         "name",
                                         "particle_emitter",
                                         "performer",
                                         "physics",
                                         "plugin",
                                         "point",
                                         "polyline",
                                         "population",
                                         "projector",
                                         "road",
                                         "sensor",
                                         "state",
                                         "texture",
                                         "trajectory",
                                         "uri",
                                         "visual",
                                         "waypoint",
                                         "world",
                                         "ruedo:collision",
                                         "ruedo:crowd",
                                         "ruedo:drive",
                                         "ruedo:fault",
                                         "ruedo:fleet",
                                         "ruedo:goal",
                                         "ruedo:left_joint",
                                         "ruedo:performer",
                                         "ruedo:right_joint",
                                         "ruedo:steer_joint",
                                         "ruedo:transducer",
                                         "ruedo:waypoint",
                                         "ruedo:wheel_joint"};

std::vector<std::string> words_of(std::string_view list) {
  std::vector<std::string> words;
  while (!list.empty()) {
    words.emplace_back(list.substr(0, list.find(' ')));
    list.remove_prefix(std::min(list.size(), words.back().size() + 1));
  }
  return words;
}

bool contains_word(std::string_view list, const std::string& word) {
  const std::vector<std::string> words = words_of(list);
  return std::find(words.begin(), words.end(), word) != words.end();
}

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

bool is_one_of(const std::string& value, std::string_view usual) {
  while (!usual.empty()) {
    const std::string_view one = usual.substr(0, usual.find('|'));
    if (value == one || same_number(value, one)) return true;
    usual.remove_prefix(std::min(usual.size(), one.size() + 1));
  }
  return false;
}

bool is_usual(const Element& element, std::string_view usual) {
  for (const auto& [name, value] : element.attributes) {
    if (name == "enabled" && (value == "false" || value == "0")) return true;
  }
  return is_one_of(element.text, usual);
}

class Walk {
 public:
  explicit Walk(Findings& to) : findings_(to) {}

  void below(const Element& element, const std::string& path, const std::string& where) {
    std::set<std::string_view> seen;
    for (const auto& child : element.children) {
      const bool ours = child->name.starts_with("ruedo:");
      const bool prefixed = child->name.find(':') != std::string::npos;
      if ((prefixed && !ours) || is_of_others(child->name)) continue;
      if (!seen.insert(child->name).second && is_once(element, child->name)) {
        findings_.unsupported(child->source, where,
                              "a second <" + child->name + "> in <" + element.name +
                                  "> is left out; the first one counts");
        continue;
      }
      const std::string here = path + "/" + child->name;
      if (!ours && !name_element(element, *child, here, where)) continue;
      std::string inside = where;
      for (const auto& [name, value] : child->attributes) {
        if (name == "name") inside += (where.empty() ? "" : "/") + child->name + " " + value;
        name_attribute(*child, here + "/@" + name, value, where);
      }
      below(*child, here, inside);
    }
  }

 private:
  // Whether anything in it matters.
  bool name_element(const Element& parent, const Element& child, const std::string& path,
                    const std::string& where) {
    bool known = may_stand_in(parent, child);
    for (const NoEffect& each : kTable) {
      if (!ends_with_path(path, each.path)) continue;
      known = true;
      if (!is_usual(child, each.usual))
        findings_.unsupported(child.source, where,
                              "<" + child.name + "> is not supported: " + each.text);
    }
    if (known && of_another_sensor(parent, child)) {
      findings_.unsupported(child.source, where,
                            "<" + child.name + "> in a <sensor> of type '" +
                                *parent.attribute("type") +
                                "' is left out: it describes other sensors");
      return false;
    }
    if (known) return true;
    report_unknown(child, "<" + child.name + "> in <" + parent.name + ">",
                   nearest_word(child.name, words_in(parent)), where, findings_);
    return false;
  }

  void name_attribute(const Element& element, const std::string& path, const std::string& value,
                      const std::string& where) {
    for (const NoEffect& each : kTable) {
      if (each.path.find('@') == std::string::npos || !ends_with_path(path, each.path) ||
          is_one_of(value, each.usual))
        continue;
      findings_.unsupported(element.source, where,
                            path.substr(path.rfind('@') + 1) + "=\"" + value + "\" of <" +
                                element.name + "> is not supported: " + each.text);
    }
  }

  static bool of_another_sensor(const Element& parent, const Element& child) {
    const std::string* type = parent.name == "sensor" ? parent.attribute("type") : nullptr;
    if (!type) return false;
    bool describes = false, own = false, known = false;
    for (const OfSensor& each : kOfSensors) {
      const bool of_type = contains_word(each.types, *type),
                 is_its = contains_word(each.elements, child.name);
      known |= of_type;
      describes |= is_its;
      own |= of_type && is_its;
    }
    return known && describes && !own;
  }

  // An element that neither SDF nor Ruedo has may be a plugin's own.
  static bool is_once(const Element& element, const std::string& child) {
    const std::vector<std::string> known = words_in(element);
    if (!child.starts_with("ruedo:") && std::find(known.begin(), known.end(), child) == known.end())
      return false;
    // Only material scripts are looked for in several places.
    const bool address = (child == "uri" && element.name != "script") ||
                         (child == "name" && element.name == "include");
    return address ||
           std::find(std::begin(kSeveral), std::end(kSeveral), child) == std::end(kSeveral);
  }

  // Not a format of ours: readers report it as a whole, or take it as it is.
  static bool is_of_others(const std::string& name) {
    return name == "plugin" || name == "transmission" || name == "ros2_control" || name == "gui";
  }
  static std::vector<std::string> words_in(const Element& element) {
    const auto found = children_in_sdf().find(element.name);
    return found == children_in_sdf().end() ? std::vector<std::string>() : words_of(found->second);
  }
  static bool may_stand_in(const Element& element, const Element& child) {
    if (std::find(std::begin(kReadersName), std::end(kReadersName), element.name) !=
        std::end(kReadersName))
      return true;
    const std::string* type = element.name == "sensor" ? element.attribute("type") : nullptr;
    if (type && std::find(std::begin(kSensorTypes), std::end(kSensorTypes), *type) ==
                    std::end(kSensorTypes))
      return true;
    const std::vector<std::string> known = words_in(element);
    return known.empty() || std::find(known.begin(), known.end(), child.name) != known.end();
  }

  Findings& findings_;
};

}  // namespace

void name_what_has_no_effect(const Element& sdf, Findings& findings) {
  Walk(findings).below(sdf, "sdf", "");
}

}  // namespace ruedo::world
