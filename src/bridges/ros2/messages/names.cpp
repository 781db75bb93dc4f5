#include "bridges/ros2/messages/names.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include <fmt/format.h>

#include "ruedo/element.h"
#include "ruedo/errors.h"

namespace ruedo::ros2 {

namespace {

constexpr std::string_view kOfAction = "/_action/";  // before the names of an action's parts

// "/a/b_2": of tokens of letters, digits and single underscores that begin with none of the digits.
bool is_absolute_name(std::string_view name) {
  char before = 0;
  for (const char c : name) {
    const bool digit = c >= '0' && c <= '9',
               letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    const bool good = before == 0 ? c == '/' : before == '/' ? letter : letter || digit || c == '/';
    if (!good || (c == '_' && before == '_')) return false;
    before = c;
  }
  return before != 0 && before != '/';
}

}  // namespace

TfLayout parse_tf_layout(const std::string& text) {
  if (text == "prefixed") return TfLayout::prefixed;
  if (text == "namespaced") return TfLayout::namespaced;
  if (text == "both") return TfLayout::both;
  throw InputError({}, "'" + text + "' is not one of prefixed, namespaced, both");
}

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

// Robots whose own name ROS allows come first.
void Names::update(const std::set<std::string>& robots) {
  std::erase_if(given_, [&](const auto& each) { return !robots.contains(each.first); });
  for (const auto& [robot, name] : wished_)
    if (robots.contains(robot)) given_.try_emplace(robot, name);
  std::set<std::string> taken;
  for (const auto& [robot, name] : given_) taken.insert(name);
  for (const bool changes : {false, true}) {
    for (const std::string& robot : robots) {
      std::string name = ros_name(robot);
      if (is_plain(robot) || given_.contains(robot) || (name != robot) != changes) continue;
      for (int i = 2; !taken.insert(name).second; ++i)
        name = ros_name(robot + "_" + std::to_string(i));
      given_[robot] = name;
    }
  }
}

std::string Names::name_of(const std::string& robot) const {
  const auto given = given_.find(robot);
  return given == given_.end() ? ros_name(robot) : given->second;
}

std::string Names::topic(const std::string& robot, const std::string& name) {
  std::string own = (is_plain(robot) ? "" : "/" + name_of(robot)) + "/" + name;
  if (asked_) asked_->insert(own);
  for (const auto& [from, to] : remaps_)
    if (own == from || own.starts_with(from + std::string(kOfAction)))
      return to + own.substr(from.size());
  return own;
}

std::string Names::frame(const std::string& robot, const std::string& name) const {
  return tf_trees(robot).front().prefix + name;
}

std::vector<Names::TfTree> Names::tf_trees(const std::string& robot) const {
  if (is_plain(robot)) return {{"", ""}};
  std::vector<TfTree> trees;
  if (tf_ != TfLayout::namespaced) trees.push_back({"", name_of(robot) + "/"});
  if (tf_ != TfLayout::prefixed) trees.push_back({robot, ""});
  return trees;
}

void Names::check_remaps() {
  const std::set<std::string> asked =
      std::exchange(asked_, std::nullopt).value_or(std::set<std::string>());
  std::set<std::string> taken = asked;
  for (const auto& [from, to] : remaps_) taken.erase(from);
  for (const auto& [from, to] : remaps_) {
    if (!is_absolute_name(to))
      throw InputError({},
                       fmt::format("--remap {}={}: '{}' is not a ROS name; it looks like /scan or "
                                   "/front/scan_2",
                                   from, to, to));
    if (!taken.insert(to).second)
      throw InputError(
          {}, fmt::format("--remap {}={}: another topic or service is named '{}'", from, to, to));
    if (asked.contains(from)) continue;
    const std::string near = nearest_word(from, {asked.begin(), asked.end()});
    throw InputError({}, "--remap: there is no ROS topic or service '" + from + "'" +
                             (near.empty() ? "" : "; did you mean '" + near + "'?"));
  }
}

}  // namespace ruedo::ros2
