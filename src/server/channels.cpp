// The channel table: names, lengths and remaps are checked here, once, before the run.
#include "server/channels.h"

#include <algorithm>

#include "ruedo/element.h"
#include "ruedo/errors.h"
#include "ruedo/reply_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/tick_t.hpp"
#include "ruedo/world_info_t.hpp"

namespace ruedo::server {

int Channels::add(Channel channel) {
  channel.bus_name = channel.name;
  for (const auto& [name, bus_name] : remaps_) {
    if (name == channel.name) channel.bus_name = bus_name;
  }
  if (channel.bus_name.empty() || channel.bus_name.size() > kMaxChannelName) {
    throw InputError({}, "channel '" + channel.bus_name + "' has " + std::to_string(channel.bus_name.size()) +
                             " characters; 1 to " + std::to_string(kMaxChannelName) +
                             " are allowed: give the robot or the device a shorter name, or use --remap");
  }
  for (const Channel& other : channels_) {
    if (other.bus_name == channel.bus_name) {
      throw InputError({}, "two channels are called '" + channel.bus_name + "': '" + other.name + "' and '" + channel.name + "'");
    }
  }
  channels_.push_back(std::move(channel));
  return static_cast<int>(channels_.size()) - 1;
}

void Channels::check_remaps() const {
  std::vector<std::string> names;
  for (const Channel& channel : channels_) names.push_back(channel.name);
  for (const auto& [name, bus_name] : remaps_) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    const std::string near = nearest_word(name, names);
    throw InputError({}, "--remap: there is no channel '" + name + "'" + (near.empty() ? "" : "; did you mean '" + near + "'?"));
  }
}

SimulationChannels add_simulation_channels(Channels& channels, bool control) {
  SimulationChannels indices;
  indices.tick = channels.add<tick_t>("ruedo/tick", "", "", kTickRate);
  indices.info = channels.add<world_info_t>("ruedo/info", "", "", kInfoRate);
  if (control) {
    indices.request = channels.add<request_t>("ruedo/request", "", "", Rate{}, true);
    indices.reply = channels.add<reply_t>("ruedo/reply", "", "", Rate{});
  }
  return indices;
}

}  // namespace ruedo::server
