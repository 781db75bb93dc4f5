// The channels of a run: what they carry, and their names on the bus.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "ruedo/index.h"
#include "ruedo/sim_time.h"

namespace ruedo::engine {

inline constexpr size_t kMaxChannelName = 63;  // LCM's limit

struct Channel {
  std::string name;      // "p3at/LRF"
  std::string bus_name;  // after --remap
  std::string robot;     // "" for channels of the simulation
  std::string device;    // "" for commands
  std::string type;      // "planar_lidar_t"
  int64_t fingerprint = 0;
  Rate rate;           // 0: every step, or on events
  bool input = false;  // clients publish on it
  bool gone = false;   // its robot was removed; the next channel of the type reuses its place
};

using ChannelIndex = Index<struct ChannelKind>;  // into Channels::list()

class Channels {
 public:
  // remaps: pairs of a channel's name and its name on the bus.
  explicit Channels(std::vector<std::pair<std::string, std::string>> remaps = {})
      : remaps_(std::move(remaps)) {}

  // Throws InputError for a name that is too long or taken.
  ChannelIndex add(Channel channel);

  template <class Message>
  ChannelIndex add(const std::string& name, const std::string& robot, const std::string& device,
                   Rate rate, bool input = false) {
    return add(
        {name, name, robot, device, Message::getTypeName(), Message::getHash(), rate, input});
  }

  const IndexedVector<ChannelIndex, Channel>& list() const { return channels_; }
  const Channel& operator[](ChannelIndex index) const { return channels_[index]; }

  // Removes a robot's channels, or those of one of its devices. All other indices remain valid.
  void remove(const std::string& robot, const std::string& device = "");

  // Throws InputError, with a suggestion, if a remap matches no channel.
  void check_remaps() const;
  void clear() {
    channels_.clear();
    by_bus_name_.clear();
  }

 private:
  std::vector<std::pair<std::string, std::string>> remaps_;
  IndexedVector<ChannelIndex, Channel> channels_;
  // only looked up, never iterated: its order is not defined
  std::unordered_map<std::string, ChannelIndex> by_bus_name_;
};

// The channels of the simulation itself, except ruedo/world, which its module announces.
struct SimulationChannels {
  ChannelIndex tick, info;
  ChannelIndex request, reply;  // none without control
};
inline constexpr Rate kTickRate{10, 1}, kInfoRate{1, 1};
SimulationChannels add_simulation_channels(Channels& channels, bool control);

}  // namespace ruedo::engine
