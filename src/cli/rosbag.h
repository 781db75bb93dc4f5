// A log as a ROS 2 bag: a folder with an MCAP file of CDR messages and the metadata.yaml by which
// rosbag2 finds it.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cli/mcap_writer.h"
#include "ros2/conversions.h"
#include "run/log_worlds.h"

namespace ruedo::cli {

class Rosbag {
 public:
  // Makes the folder (no slash at its end). Throws InputError when it is there already, and
  // EnvironmentError when it cannot be made.
  Rosbag(const std::string& folder, ros2::ConversionOptions options);
  ~Rosbag();  // a bag that was not finished is removed

  // What runs from now on.
  void begin_scene(const run::LogWorlds::Scene& scene, uint64_t time_ns);
  // A message as it came; one that ROS has no type for, or that is damaged, is left out and
  // counted.
  void add(const std::string& channel, uint64_t time_ns, std::span<const uint8_t> message);
  void finish();

  uint64_t messages() const { return out_->messages(); }
  uint64_t left_out() const { return left_out_; }

 private:
  struct Recorded {
    ros2::Topic topic;
    uint16_t channel;
    uint64_t messages = 0;
  };

  void write(const ros2::Topic& topic, uint64_t time_ns, std::span<const uint8_t> cdr);
  std::string metadata() const;

  std::string folder_, file_;
  ros2::ConversionOptions options_;
  std::optional<ros2::Names> names_;
  std::unique_ptr<McapWriter> out_;
  std::unique_ptr<ros2::Conversions> conversions_;
  std::map<std::string, uint16_t> schemas_;
  std::map<std::string, Recorded> topics_;  // by name and type
  uint64_t begin_ns_ = 0, end_ns_ = 0, left_out_ = 0;
  bool finished_ = false;
};

}  // namespace ruedo::cli
