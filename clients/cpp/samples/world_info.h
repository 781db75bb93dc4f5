// Puts the parts of ruedo/info together.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "ruedo/client.h"

namespace ruedo::client {

struct ChannelInfo {
  std::string name, robot, device, type;
  int64_t fingerprint = 0;
  double rate = 0.0;
  bool input = false;
};

// One complete ruedo/info.
struct WorldInfo {
  int64_t utime = 0;  // of the first message that said this
  int64_t run_id = 0;
  int32_t epoch = 0;
  std::string version, world;
  int64_t seed = 0, step_us = 0, features = 0;
  bool paused = false;
  std::vector<RobotInfo> robots;
  std::map<std::string, size_t> robot_index;
  std::map<std::string, std::vector<DeviceInfo>> devices;    // by robot
  std::map<std::string, std::vector<ChannelInfo>> channels;  // by robot
  std::vector<ChannelInfo> channel_list;                     // as ruedo/tick counts them
  std::vector<BodyInfo> bodies;                              // that are there now
  int32_t tick_channel = -1;                                 // in that list

  const RobotInfo* robot(const std::string& name) const;
};

// A type's fingerprint as lcm-gen's sources write it, without the 0x.
std::string hex(int64_t fingerprint);

// Decodes a world_info_t; nothing if this client cannot read it.
std::optional<int64_t> run_id_of(const uint8_t* bytes, size_t size);

// Takes messages of ruedo/info as they come. The parts of one info share run, epoch and utime. An
// info with the same content as the last one, which is the rule, is recognised by its bytes and not
// decoded.
class WorldInfoAssembler {
 public:
  // The info, when this message completed a new one. Throws TypeMismatch for another version of the
  // type, and for more than a server sends.
  std::shared_ptr<const WorldInfo> add(const uint8_t* bytes, size_t size);

 private:
  void check_size(int nparts);
  using Key = std::tuple<int64_t, int64_t, int32_t, int>;  // utime, run, epoch, nparts
  Key key_{};
  std::map<int, std::vector<uint8_t>> parts_;
  std::map<int, std::vector<uint8_t>> last_;  // without fingerprint and utime
};

}  // namespace ruedo::client
