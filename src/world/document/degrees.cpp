// A walk over the document as written.
#include "world/document/degrees.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

namespace ruedo::world {
namespace {

constexpr double kTurn = 2.0 * M_PI;

bool reads_as_degrees(double value) {
  return std::abs(value) > kTurn && std::fmod(value, 5.0) == 0.0;
}

// Limits of 10, 50 or 100 rad, or beyond 360, are written for "never reached".
bool limit_reads_as_degrees(double value) {
  const double size = std::abs(value);
  return reads_as_degrees(value) && size <= 360.0 && size != 10.0 && size != 50.0 && size != 100.0;
}

// Text that is not a number is skipped here: the element's reader refuses it.
std::vector<double> numbers_of(const std::string& text) {
  std::istringstream words(text);
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    double value = 0.0;
    const char* const end = word.data() + word.size();
    if (std::from_chars(word.data(), end, value).ptr != end) return {};
    numbers.push_back(value);
  }
  return numbers;
}

bool is_true(const std::string* written) {
  return written && (*written == "true" || *written == "True" || *written == "1");
}

class Walk {
 public:
  explicit Walk(Findings& findings) : findings_(findings) {}

  void below(const Element& element, const std::string& where, const Element* joint) {
    for (const auto& child : element.children) {
      if (child->name == "plugin") continue;
      const std::string* name = child->attribute("name");
      std::string inside = where;
      if (name) inside += (where.empty() ? "" : "/") + child->name + " " + *name;
      if (child->name == "pose") look_at_pose(*child, where);
      if (child->name == "origin") look_at_origin(*child, where);
      if (child->name == "limit" && turns(joint)) look_at_limit(*child, where);
      below(*child, inside, child->name == "joint" ? child.get() : joint);
    }
  }

 private:
  static bool turns(const Element* joint) {
    const std::string* type = joint ? joint->attribute("type") : nullptr;
    return type && (*type == "revolute" || *type == "universal" || *type == "revolute2");
  }

  void look_at_pose(const Element& pose, const std::string& where) {
    const std::string* format = pose.attribute("rotation_format");
    if (is_true(pose.attribute("degrees")) || (format && *format == "quat_xyzw")) return;
    const std::vector<double> numbers = numbers_of(pose.text);
    if (numbers.size() == 5)
      findings_.repaired(pose.source, where,
                         "<pose>" + pose.text +
                             "</pose> has 5 numbers; x y z roll pitch yaw are six: the yaw is 0");
    if (numbers.size() == 6 && std::any_of(numbers.begin() + 3, numbers.end(), reads_as_degrees))
      name(pose, where, "the rotation of <pose>" + pose.text + "</pose>", " or degrees=\"true\"");
  }

  void look_at_origin(const Element& origin, const std::string& where) {
    const std::string* rpy = origin.attribute("rpy");
    if (!rpy || origin.attribute("quat_xyzw")) return;
    const std::vector<double> numbers = numbers_of(*rpy);
    if (std::any_of(numbers.begin(), numbers.end(), reads_as_degrees))
      name(origin, where, "rpy=\"" + *rpy + "\"", "");
  }

  // URDF has attributes, SDF elements.
  void look_at_limit(const Element& limit, const std::string& where) {
    for (const char* side : {"lower", "upper"}) {
      const std::string* written = limit.attribute(side);
      const Element* child = limit.child(side);
      if (!written && !child) continue;
      const std::vector<double> numbers = numbers_of(written ? *written : child->text);
      if (numbers.size() != 1 || !limit_reads_as_degrees(numbers[0])) continue;
      const std::string word = side;
      const std::string shown = written ? word + "=\"" + *written + "\" of <limit>"
                                        : "<" + word + ">" + child->text + "</" + word + ">";
      name(written ? limit : *child, where, shown, "");
    }
  }

  void name(const Element& at, const std::string& where, const std::string& what,
            const std::string& cure) {
    findings_.unsupported(at.source, where,
                          what + " reads as degrees, and is taken as radians, which angles are: " +
                              "write radians" + cure);
  }

  Findings& findings_;
};

}  // namespace

void name_degrees(const Element& root, Findings& findings) {
  Walk(findings).below(root, "", nullptr);
}

}  // namespace ruedo::world
