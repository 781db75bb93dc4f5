// The table of what Ruedo publishes in ROS: a bus message in, one or more ROS messages out.
//
// Independent of any network: `ruedo run --ros2` sends the result, `ruedo export --ros2` writes it
// into a bag.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "bridges/ros2/messages/cdr.h"
#include "bridges/ros2/messages/interfaces.h"
#include "bridges/ros2/messages/names.h"
#include "bridges/ros2/messages/robot_frames.h"
#include "bridges/ros2/topic.h"
#include "ruedo/pose.h"
#include "ruedo/world_info_t.hpp"

namespace ruedo::ros2 {

struct ConversionOptions {
  Distro distro = Distro::jazzy;
  std::string root;  // the robot without a namespace; "": none
  Remaps topics;     // of ROS names
  TfLayout tf = TfLayout::both;
  std::vector<std::pair<std::string, std::string>> channels;  // the bus's --remap
  // The links of the current robots; none: not known.
  std::function<std::map<std::string, RobotFrames>()> robots = [] {
    return std::map<std::string, RobotFrames>();
  };
};

class Conversions {
 public:
  using Wanted = std::function<bool(size_t topic)>;
  using Emit = std::function<void(size_t topic, std::span<const uint8_t> cdr)>;

  // info: all parts of ruedo/info. names: get its robots.
  Conversions(const std::vector<world_info_t>& info, const ConversionOptions& options,
              Names& names);
  ~Conversions();

  const std::vector<Topic>& topics() const { return topics_; }

  // The topics for a channel, as indices into topics().
  const std::vector<size_t>& topics_of(const std::string& channel) const;

  // Converts the wanted topics of a message. False: wrong type for the channel, or damaged.
  bool convert(const std::string& channel, std::span<const uint8_t> message, const Wanted& wanted,
               const Emit& emit);

  // Published once, also for late subscribers: the poses of links and devices on their robots
  // (/tf_static), and each robot_description.
  struct Standing {
    Topic topic;
    std::vector<uint8_t> cdr;
  };
  const std::vector<Standing>& standing() const { return standing_; }

  struct Route;

 private:
  struct Plan;
  template <class Message>
  void add_route(const channel_info_t& channel, Plan& plan);
  size_t add_topic(Topic topic);
  // In each tree of tf that has the robot.
  void add_frame(const std::string& robot, const std::string& parent, const std::string& child,
                 const Pose& X, Names& names);
  void add_alias(const std::string& robot, const std::string& name, Names& names);
  void add_frames(const device_info_t& device, const Plan& plan);
  void add_links(const std::string& name, const RobotFrames& robot, Names& names);

  std::vector<Topic> topics_;
  std::unordered_map<std::string, size_t> by_name_;                 // of topics
  std::unordered_map<std::string, std::vector<size_t>> topics_of_;  // by channel; looked up only
  std::unordered_map<std::string, std::unique_ptr<Route>> routes_;  // by channel; looked up only
  struct Frame {
    std::string parent, child;
    double position[3], orientation[4];  // w, x, y, z
  };
  std::map<std::string, std::vector<Frame>> frames_;  // by topic
  std::vector<Standing> standing_;
};

// rosgraph_msgs/msg/Clock, and others without a bus message.
std::vector<uint8_t> clock_message(int64_t utime);

void put_time(CdrWriter& out, int64_t utime);
void put_header(CdrWriter& out, int64_t utime, const std::string& frame);

}  // namespace ruedo::ros2
