// What robots, devices and frames are called in ROS.
//
// A robot that is alone when a run begins has the root namespace and plain frames ("/scan",
// "base_link"); every other has its own
// ("/alice/scan", "alice/base_link"), those that come later, too. Names that ROS does not allow are
// made so that it does, and each is given once.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace ruedo::ros2 {

using Remaps = std::vector<std::pair<std::string, std::string>>;  // "/scan", "/front/scan"

class Names {
 public:
  // root: the robot without a namespace; "": none. remaps: of topics and services, whole names.
  Names(std::string root, Remaps remaps) : root_(std::move(root)), remaps_(std::move(remaps)) {}

  // "/alice/scan" for ("alice", "scan"); the world's own have robot "". Throws InputError when two
  // remaps make one name of two.
  std::string topic(const std::string& robot, const std::string& name);
  std::string frame(const std::string& robot, const std::string& name) const;

  // Throws InputError when a remap names no topic that was asked for.
  void check_remaps() const;

 private:
  bool is_plain(const std::string& robot) const { return robot.empty() || robot == root_; }

  std::string root_;
  Remaps remaps_;
  std::set<std::string> asked_;
};

// Letters, digits and underscores; no digit ahead.
std::string ros_name(const std::string& name);

}  // namespace ruedo::ros2
