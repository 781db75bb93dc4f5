#include "ros2/names.h"

#include <algorithm>
#include <cctype>

#include "ruedo/element.h"
#include "ruedo/errors.h"

namespace ruedo::ros2 {

std::string ros_name(const std::string& name) {
  std::string text;
  for (const char c : name) {
    const bool allowed =
        std::isalnum(static_cast<unsigned char>(c)) && static_cast<unsigned char>(c) < 128;
    if (allowed)
      text += c;
    else if (!text.ends_with('_'))
      text += '_';  // two in a row are not allowed
  }
  if (text.empty() || std::isdigit(static_cast<unsigned char>(text[0]))) text = "r" + text;
  return text;
}

std::string Names::topic(const std::string& robot, const std::string& name) {
  const std::string own = (is_plain(robot) ? "" : "/" + ros_name(robot)) + "/" + name;
  if (asked_) asked_->insert(own);
  const auto remap = std::find_if(remaps_.begin(), remaps_.end(),
                                  [&](const auto& each) { return each.first == own; });
  return remap == remaps_.end() ? own : remap->second;
}

std::string Names::frame(const std::string& robot, const std::string& name) const {
  return (is_plain(robot) ? "" : ros_name(robot) + "/") + name;
}

void Names::check_remaps() {
  const std::set<std::string> asked =
      std::exchange(asked_, std::nullopt).value_or(std::set<std::string>());
  for (const auto& [from, to] : remaps_) {
    if (asked.contains(from)) continue;
    const std::string near = nearest_word(from, {asked.begin(), asked.end()});
    throw InputError({}, "--remap: there is no ROS topic or service '" + from + "'" +
                             (near.empty() ? "" : "; did you mean '" + near + "'?"));
  }
}

}  // namespace ruedo::ros2
