#include "world/urdf/urdf_repair.h"

#include <algorithm>
#include <locale>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <vector>

#include <fmt/format.h>

#include "base/text.h"
#include "world/read/read_context.h"

namespace ruedo::world {
namespace {

// The numbers separated by blanks, as urdfdom parses them; nullopt: the text holds something else.
std::optional<std::vector<double>> numbers_in(const std::string& text) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  std::vector<double> values;
  for (double value = 0.0; in >> value;) values.push_back(value);
  if (!in.eof()) return std::nullopt;
  return values;
}

// -1: the text holds something else.
int count_of_numbers(const std::string& text) {
  const auto values = numbers_in(text);
  return values ? static_cast<int>(values->size()) : -1;
}

// "nan", "1e999" and their like, which count as no numbers above.
bool holds_what_is_not_finite(const std::string& text) {
  Element written;
  written.text = text;
  try {
    written.as_numbers({});
  } catch (const NotFinite&) {
    return true;
  } catch (const InputError&) {
    return false;  // words
  }
  return false;
}

std::string name_of(const Element& element) {
  const std::string* name = element.attribute("name");
  return name ? *name : "";
}

// The link named by a joint's <parent> or <child>; "": none.
std::string end_of(const Element& joint, const char* which) {
  const Element* end = joint.child(which);
  const std::string* link = end ? end->attribute("link") : nullptr;
  return link ? *link : "";
}

class Repair {
 public:
  Repair(Element& robot, Findings& findings) : robot_(robot), findings_(findings) {}

  void run() {
    leave_out_namesakes();
    colours(robot_, "robot " + name_of(robot_));
    for (const auto& child : robot_.children) {
      if (child->name != "joint") continue;
      places(*child, "");
      numbers(*child);
      type(*child);
      below_zero(*child);
    }
    leave_out_joints();
    leave_out_loose_links();
  }

 private:
  // value: what is wrong, as written.
  void error(const Source& source, const std::string& where, const std::string& value,
             const std::string& fault, const std::string& instead) {
    const std::string text = fault + "; " + instead;
    if (holds_what_is_not_finite(value))
      findings_.error(NotFinite(source, fault), where, text);
    else
      findings_.error(source, where, text);
  }

  // Removes the elements for which `odd` returns a reason, and reports them.
  template <typename Odd>
  void leave_out(const Odd& odd) {
    std::erase_if(robot_.children, [&](const auto& child) {
      if (child->name != "link" && child->name != "joint") return false;
      const std::string reason = odd(*child);
      if (reason.empty()) return false;
      findings_.error(child->source, child->name + " " + name_of(*child),
                      reason + "; the " + child->name + " is left out");
      return true;
    });
  }

  void leave_out_namesakes() {
    std::set<std::string> links, joints;
    leave_out([&](const Element& each) -> std::string {
      const std::string name = name_of(each);
      if (name.empty()) return "a <" + each.name + "> without a name";
      return (each.name == "link" ? links : joints).insert(name).second
                 ? ""
                 : "a second <" + each.name + "> of the name '" + name + "'";
    });
  }

  // Commas between coordinates are replaced by blanks; a pose that cannot be parsed is dropped.
  void places(Element& element, const std::string& where) {
    const std::string* name = element.attribute("name");
    const std::string inside = name ? element.name + " " + *name : where;
    for (const auto& child : element.children) places(*child, inside);
    if (element.name != "origin" && element.name != "axis") return;
    for (auto& [attribute, value] : element.attributes) {
      if ((attribute != "xyz" && attribute != "rpy") || count_of_numbers(value) == 3) continue;
      const std::string written =
          fmt::format("{}=\"{}\" of <{}> is not three numbers", attribute, value, element.name);
      std::string blanks = value;
      std::replace(blanks.begin(), blanks.end(), ',', ' ');
      if (count_of_numbers(blanks) == 3) {
        findings_.repaired(element.source, where, written + "; its commas are taken for blanks");
        value = blanks;
      } else {
        const std::string instead = element.name == "axis" ? "1 0 0" : "0 0 0";
        error(element.source, where, value, written, instead + " is taken");
        value = instead;
      }
    }
  }

  // For <limit>, <dynamics>, <mimic> and elements that are not used here: all attributes but names
  // are numbers.
  void numbers(Element& joint) {
    static const std::set<std::string> kOfNumbers = {"limit", "dynamics", "mimic",
                                                     "safety_controller", "calibration"};
    std::erase_if(joint.children, [&](const auto& child) {
      if (kOfNumbers.count(child->name) == 0) return false;
      std::string reason, wrong;
      for (const auto& [attribute, value] : child->attributes) {
        if (attribute == "joint" || count_of_numbers(value) == 1) continue;
        reason = fmt::format("{}=\"{}\" is not a number", attribute, value);
        wrong = value;
      }
      if (child->name == "mimic" && !child->attribute("joint")) reason = "it names no joint";
      if (reason.empty()) return false;
      error(child->source, "joint " + name_of(joint), wrong,
            fmt::format("<{}>: {}", child->name, reason), "it is left out");
      return true;
    });
  }

  // urdfdom takes these as they are.
  void below_zero(Element& joint) {
    struct Quantity {
      const char *element, *attribute, *instead, *text;
    };
    constexpr Quantity kAll[] = {{"dynamics", "damping", "0", "0 is used"},
                                 {"dynamics", "friction", "0", "0 is used"},
                                 {"limit", "effort", "0", "there is no limit"},
                                 {"limit", "velocity", "0", "there is no limit"}};
    for (const Quantity& each : kAll) {
      Element* of = joint.child(each.element);
      if (!of) continue;
      for (auto& [attribute, value] : of->attributes) {
        const auto number = attribute == each.attribute ? numbers_in(value) : std::nullopt;
        if (!number || number->size() != 1 || !(number->front() < 0.0)) continue;
        findings_.error(of->source, "joint " + name_of(joint),
                        fmt::format("{}=\"{}\" of <{}> is not allowed; allowed is a number of at "
                                    "least 0; {}",
                                    attribute, value, of->name, each.text));
        value = each.instead;
      }
    }
  }

  // Four numbers from 0 to 1. Of others urdfdom makes no colour, and says nothing.
  void colours(Element& element, const std::string& where) {
    for (const auto& child : element.children) {
      const std::string* name = child->attribute("name");
      if (child->name != "gazebo")
        colours(*child, child->name == "link" && name ? "link " + *name : where);
    }
    if (element.name != "color") return;
    for (auto& [attribute, value] : element.attributes) {
      if (attribute != "rgba") continue;
      const std::string written =
          "rgba=\"" + value + "\" of <color> is not four numbers from 0 to 1";
      std::vector<double> v = numbers_in(value).value_or(std::vector<double>());
      if (v.size() == 3) {
        findings_.repaired(element.source, where, written + "; it is opaque");
        v.push_back(1.0);
      } else if (v.size() != 4) {
        error(element.source, where, value, written, "it is grey instead");
        v = {0.7, 0.7, 0.7, 1.0};
      }
      value.clear();
      for (const double each : v) {
        const double inside = std::clamp(each, 0.0, 1.0);
        if (inside != each)
          findings_.error(element.source, where, written + "; each counts as the nearest of these");
        value += (value.empty() ? "" : " ") + shown(inside);
      }
    }
  }

  void type(Element& joint) {
    static const std::set<std::string> kTypes = {"fixed",     "revolute", "continuous",
                                                 "prismatic", "planar",   "floating"};
    const auto found = std::find_if(joint.attributes.begin(), joint.attributes.end(),
                                    [](const auto& each) { return each.first == "type"; });
    const std::string written = found == joint.attributes.end() ? "" : found->second;
    if (kTypes.count(written) == 0) {
      findings_.error(
          joint.source, "joint " + name_of(joint),
          "type '" + written +
              "' is unknown; allowed are fixed, revolute, continuous, prismatic, planar "
              "and floating; it is taken as fixed");
      if (found == joint.attributes.end())
        joint.attributes.emplace_back("type", "fixed");
      else
        found->second = "fixed";
    } else if ((written == "revolute" || written == "prismatic") && !joint.has("limit")) {
      findings_.error(joint.source, "joint " + name_of(joint),
                      "a " + written + " joint without <limit>; it has none");
      auto limit = std::make_unique<Element>();
      limit->name = "limit";
      limit->source = joint.source;
      // Values beyond our limits mean "no limit".
      limit->attributes = {
          {"lower", "-1e17"}, {"upper", "1e17"}, {"effort", "0"}, {"velocity", "0"}};
      joint.children.push_back(std::move(limit));
    }
  }

  void leave_out_joints() {
    std::set<std::string> links;
    for (const Element* link : robot_.all("link")) links.insert(name_of(*link));
    leave_out([&](const Element& joint) -> std::string {
      if (joint.name != "joint") return "";
      for (const char* which : {"parent", "child"}) {
        const std::string link = end_of(joint, which);
        if (link.empty()) return std::string("names no ") + which + " link";
        if (links.count(link) == 0)
          return std::string("its ") + which + " link '" + link + "' is not there";
      }
      return "";
    });
    const std::set<const Element*> circular = closing_circles();
    leave_out([&](const Element& joint) -> std::string {
      return circular.count(&joint) == 0
                 ? ""
                 : "'" + end_of(joint, "child") + "' would be its own ancestor";
    });
  }

  // The joints that close a cycle: depth-first search from each link to its parents.
  std::set<const Element*> closing_circles() const {
    std::map<std::string, std::vector<const Element*>> joints_of;  // by the joints' child
    for (const Element* joint : robot_.all("joint"))
      joints_of[end_of(*joint, "child")].push_back(joint);
    enum class State { unseen, on_the_way, done };
    std::map<std::string, State> states;
    std::set<const Element*> closing;
    for (const Element* link : robot_.all("link")) {
      const std::string first = name_of(*link);
      // links, with the number of joints followed until now
      std::vector<std::pair<std::string, size_t>> way;
      if (states[first] == State::unseen) way.emplace_back(first, 0);
      while (!way.empty()) {
        auto& [at, followed] = way.back();
        states[at] = State::on_the_way;
        const auto hangs_by = joints_of.find(at);
        if (hangs_by == joints_of.end() || followed == hangs_by->second.size()) {
          states[at] = State::done;
          way.pop_back();
          continue;
        }
        const Element* joint = hangs_by->second[followed++];
        const std::string parent = end_of(*joint, "parent");
        if (states[parent] == State::on_the_way) closing.insert(joint);
        if (states[parent] == State::unseen) way.emplace_back(parent, 0);
      }
    }
    return closing;
  }

  // Keeps the largest connected group of links; the first one of equal size.
  void leave_out_loose_links() {
    // disjoint sets: a link closer to the group's representative
    std::map<std::string, std::string> next;
    const auto one_of = [&](std::string link) {
      for (auto at = next.find(link); at != next.end(); at = next.find(link)) {
        if (const auto after = next.find(at->second); after != next.end())
          at->second = after->second;
        link = at->second;
      }
      return link;
    };
    for (const Element* joint : robot_.all("joint")) {
      const std::string child = one_of(end_of(*joint, "child")),
                        parent = one_of(end_of(*joint, "parent"));
      if (child != parent) next[child] = parent;
    }
    std::vector<std::string> all;
    std::map<std::string, int> sizes;
    for (const Element* link : robot_.all("link")) {
      const std::string one = one_of(name_of(*link));
      if (++sizes[one] == 1) all.push_back(one);
    }
    if (all.size() < 2) return;
    const std::string kept = *std::max_element(
        all.begin(), all.end(), [&](const auto& a, const auto& b) { return sizes[a] < sizes[b]; });
    leave_out([&](const Element& each) -> std::string {
      const std::string link = each.name == "link" ? name_of(each) : end_of(each, "child");
      return one_of(link) == kept ? "" : "is not connected to '" + kept + "'";
    });
  }

  Element& robot_;
  Findings& findings_;
};

}  // namespace

void repair_urdf(Element& robot, Findings& findings) { Repair(robot, findings).run(); }

}  // namespace ruedo::world
