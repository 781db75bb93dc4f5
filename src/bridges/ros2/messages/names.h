// Names of robots, devices and frames in ROS.
//
// A robot that is alone when a run begins has the root namespace and plain frames ("/scan",
// "base_link"); every other one, including those that join later, has its own ("/alice/scan",
// "alice/base_link"). Names that ROS does not allow are changed, and each is given only once.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace ruedo::ros2 {

using Remaps = std::vector<std::pair<std::string, std::string>>;  // "/scan", "/front/scan"

// Where tf has the frames of a robot with a namespace.
enum class TfLayout {
  prefixed,    // "alice/odom" on /tf
  namespaced,  // "odom" on /alice/tf, as Nav2's launch files for several robots have it
  both,        // messages have "alice/lrf", which /alice/tf ties to its own "lrf"
};
// "prefixed", "namespaced" or "both".
TfLayout parse_tf_layout(const std::string& text);

class Names {
 public:
  // root: the robot without a namespace; "": none. remaps: full names of topics and services.
  Names(std::string root, Remaps remaps, TfLayout tf = TfLayout::both)
      : root_(std::move(root)), remaps_(std::move(remaps)), tf_(tf) {}

  // Robots that have another namespace than their name ("fleet/alice"), from the next update() on.
  void wish(std::map<std::string, std::string> namespaces) { wished_ = std::move(namespaces); }
  // The robots of the run. Each keeps its name in ROS for as long as it exists.
  void update(const std::set<std::string>& robots);

  // "/alice/scan" for ("alice", "scan"); the world's own names have robot "". Throws InputError if
  // two remaps give the same name.
  std::string topic(const std::string& robot, const std::string& name);
  std::string frame(const std::string& robot, const std::string& name) const;  // in messages

  // The trees of tf that have the robot; messages have the frames of the first.
  struct TfTree {
    std::string robot;   // whose topics tf and tf_static it is; "": /tf
    std::string prefix;  // of the frames: "alice/"
  };
  std::vector<TfTree> tf_trees(const std::string& robot) const;

  // Throws InputError if a remap's topic has not been used.
  void check_remaps();

 private:
  bool is_plain(const std::string& robot) const {
    return robot.empty() || (robot == root_ && !given_.contains(robot));
  }
  std::string name_of(const std::string& robot) const;

  std::string root_;
  Remaps remaps_;
  TfLayout tf_;
  std::map<std::string, std::string> wished_;                             // namespaces, by robot
  std::map<std::string, std::string> given_;                              // names in ROS, by robot
  std::optional<std::set<std::string>> asked_ = std::set<std::string>();  // none: it was checked
};

// Letters, digits and underscores; no leading digit.
std::string ros_name(const std::string& name);

}  // namespace ruedo::ros2
