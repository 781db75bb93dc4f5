// The channel table: checks names, lengths and remaps once, before the run.
#include "engine/channels.h"

#include <algorithm>

#include "base/channel_names.h"
#include "ruedo/element.h"
#include "ruedo/errors.h"
#include "ruedo/reply_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/tick_t.hpp"
#include "ruedo/world_info_t.hpp"

namespace ruedo::engine {

ChannelIndex Channels::add(Channel channel) {
  channel.bus_name = channel.name;
  for (const auto& [name, bus_name] : remaps_) {
    if (name == channel.name) channel.bus_name = bus_name;
  }
  if (channel.bus_name.empty() || channel.bus_name.size() > kMaxChannelName) {
    throw InputError(
        {}, "channel '" + channel.bus_name + "' has " + std::to_string(channel.bus_name.size()) +
                " characters; 1 to " + std::to_string(kMaxChannelName) +
                " are allowed: give the robot or the device a shorter name, or use --remap");
  }
  const auto free = [&](const Channel& old) {
    return old.gone && old.type == channel.type && old.input == channel.input;
  };
  auto place = channels_.end();
  if (by_bus_name_.size() <
      channels_.size()) {  // a removed one may be reused; not while a world is loaded
    place = std::find_if(channels_.begin(), channels_.end(),
                         [&](const Channel& old) { return free(old) && old.name == channel.name; });
    if (place == channels_.end()) place = std::find_if(channels_.begin(), channels_.end(), free);
  }
  const ChannelIndex index(place - channels_.begin());
  if (const auto [other, added] = by_bus_name_.try_emplace(channel.bus_name, index); !added) {
    throw InputError({}, "two channels are called '" + channel.bus_name + "': '" +
                             channels_[other->second].name + "' and '" + channel.name + "'");
  }
  if (place == channels_.end()) {
    channels_.push_back(std::move(channel));
  } else {
    *place = std::move(channel);
  }
  return index;
}

void Channels::remove(const std::string& robot, const std::string& device) {
  for (Channel& channel : channels_) {
    if (channel.robot != robot || channel.gone) continue;
    if (!device.empty() && channel.device != device) continue;
    channel.gone = true;
    by_bus_name_.erase(channel.bus_name);
  }
}

void Channels::check_remaps() const {
  std::vector<std::string> names;
  for (const Channel& channel : channels_) names.push_back(channel.name);
  for (const auto& [name, bus_name] : remaps_) {
    for (const char* own : {kInfoChannel, kTickChannel, kRequestChannel, kReplyChannel}) {
      if (name == own)
        throw InputError({}, "--remap: '" + name + "' keeps its name: clients find the run by it");
    }
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    const std::string near = nearest_word(name, names);
    throw InputError({}, "--remap: there is no channel '" + name + "'" +
                             (near.empty() ? "" : "; did you mean '" + near + "'?"));
  }
}

SimulationChannels add_simulation_channels(Channels& channels, bool control) {
  SimulationChannels indices;
  indices.tick = channels.add<tick_t>(kTickChannel, "", "", kTickRate);
  indices.info = channels.add<world_info_t>(kInfoChannel, "", "", kInfoRate);
  if (control) {
    indices.request = channels.add<request_t>(kRequestChannel, "", "", Rate{}, true);
    indices.reply = channels.add<reply_t>(kReplyChannel, "", "", Rate{});
  }
  return indices;
}

}  // namespace ruedo::engine
