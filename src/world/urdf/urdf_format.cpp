#include "world/urdf/urdf_format.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "world/read/read_context.h"

namespace ruedo::world {
namespace {

using Words = std::vector<std::string>;

struct Format {
  Words children, attributes;
};

// Elements that a robot or a link may have more than once. Of all others urdfdom uses the first.
constexpr std::string_view kSeveral[] = {"link",         "joint",        "material", "gazebo",
                                         "transmission", "ros2_control", "visual",   "collision"};

// Including parts that no simulator reads: <safety_controller>, <calibration>, <verbose>.
const std::map<std::string_view, Format>& formats() {
  static const std::map<std::string_view, Format> table = {
      {"robot",
       {{"link", "joint", "material", "gazebo", "transmission", "ros2_control"},
        {"name", "version"}}},
      {"link", {{"inertial", "visual", "collision"}, {"name", "type"}}},
      {"inertial", {{"origin", "mass", "inertia"}, {}}},
      {"mass", {{}, {"value"}}},
      {"inertia", {{}, {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}}},
      {"origin", {{}, {"xyz", "rpy", "quat_xyzw"}}},
      {"visual", {{"origin", "geometry", "material"}, {"name"}}},
      {"collision", {{"origin", "geometry", "verbose"}, {"name"}}},
      {"geometry", {{"box", "sphere", "cylinder", "mesh"}, {}}},
      {"box", {{}, {"size"}}},
      {"sphere", {{}, {"radius"}}},
      {"cylinder", {{}, {"radius", "length"}}},
      {"mesh", {{}, {"filename", "scale"}}},
      {"material", {{"color", "texture"}, {"name"}}},
      {"color", {{}, {"rgba"}}},
      {"texture", {{}, {"filename"}}},
      {"joint",
       {{"origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "safety_controller",
         "calibration"},
        {"name", "type"}}},
      {"parent", {{}, {"link"}}},
      {"child", {{}, {"link"}}},
      {"axis", {{}, {"xyz"}}},
      {"limit", {{}, {"lower", "upper", "effort", "velocity"}}},
      {"dynamics", {{}, {"damping", "friction"}}},
      {"mimic", {{}, {"joint", "multiplier", "offset"}}},
      {"safety_controller",
       {{}, {"soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"}}},
      {"calibration", {{}, {"rising", "falling", "reference_position"}}},
  };
  return table;
}

bool holds(const Words& words, const std::string& word) {
  return word.find(':') != std::string::npos || word.starts_with("xmlns") ||
         std::find(words.begin(), words.end(), word) != words.end();
}

void look(const Element& element, const std::string& where, Findings& findings) {
  const auto format = formats().find(element.name);
  if (format == formats().end()) return;
  const auto& [children, attributes] = format->second;
  for (const auto& [name, value] : element.attributes) {
    // No simulator reads others, such as a <geometry>'s name or an <axis>'s rpy.
    const std::string near = nearest_word(name, attributes);
    if (holds(attributes, name) || near.empty()) continue;
    findings.unsupported(element.source, where,
                         name + "=\"" + value + "\" of <" + element.name +
                             "> is not supported and left out; did you mean " + near + "?");
  }
  std::set<std::string_view> seen;
  for (const auto& child : element.children) {
    if (!holds(children, child->name)) {
      report_unknown(*child, "<" + child->name + "> in <" + element.name + ">",
                     nearest_word(child->name, children), where, findings);
      continue;
    }
    const std::string_view kind =
        element.name == "geometry" ? std::string_view("shape") : child->name;
    if (!seen.insert(kind).second && child->name.find(':') == std::string::npos &&
        std::find(std::begin(kSeveral), std::end(kSeveral), child->name) == std::end(kSeveral)) {
      findings.unsupported(child->source, where,
                           "a second <" + child->name + "> in <" + element.name +
                               "> is left out; the first one counts");
      continue;
    }
    const std::string* name = child->attribute("name");
    look(*child, name ? where + "/" + child->name + " " + *name : where, findings);
  }
}

}  // namespace

void name_what_urdf_lacks(const Element& robot, Findings& findings) {
  const std::string* name = robot.attribute("name");
  look(robot, "robot " + (name ? *name : ""), findings);
}

}  // namespace ruedo::world
