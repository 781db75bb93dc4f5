// The console's branch of the publisher: counts, copies on demand, never waits.
#include "console/tap.h"

#include <algorithm>
#include <utility>

#include "base/channel_names.h"
#include "console/board.h"
#include "console/drawn.h"

namespace ruedo::console {

void Tap::announce(const std::shared_ptr<const run::Announcement>& announcement) {
  const auto& channels = announcement->channels.list();
  by_index_.assign(channels.size(), nullptr);
  const auto world = std::find_if(channels.begin(), channels.end(), [](const engine::Channel& c) {
    return c.name == kWorldChannel && !c.gone;
  });
  state_index_ = world == channels.end() ? engine::ChannelIndex()
                                         : engine::ChannelIndex(world - channels.begin());
  const std::lock_guard lock(names_mutex_);
  inputs_.clear();
  for (const engine::Channel& channel : channels) {
    if (channel.input && !channel.gone) inputs_.insert(channel.bus_name);
  }
}

void Tap::message(const run::Published& message) {
  Traffic*& traffic = by_index_[message.index];
  if (!traffic) traffic = find(message.channel);
  if (!traffic) return;
  const bool offered = offer(*traffic, message.data, message.size);
  if (message.index == state_index_)
    keep_state(traffic->index, {message.data, message.size}, offered);
}

void Tap::keep_state(uint32_t channel, std::span<const uint8_t> part, bool offered) {
  const std::lock_guard lock(state_mutex_);
  if (!Board::is_later_part(part)) {
    state_.parts.clear();
    state_was_told_ = true;
  }
  state_.channel = channel;
  state_.parts.emplace_back(part.begin(), part.end());
  if (!offered) state_was_told_ = false;
}

Tap::State Tap::take_state(size_t channels) {
  const std::lock_guard lock(state_mutex_);
  if (state_was_told_ || state_.channel >= channels) return {};
  state_was_told_ = true;
  return state_;
}

void Tap::hear(const std::string& channel, const uint8_t* data, size_t size) {
  Traffic* traffic = find(channel);
  if (!traffic) return;
  const std::span message(data, size);
  const std::string layer = layer_of(message);
  if (layer.empty()) {
    offer(*traffic, data, size);
    return;
  }
  count(*traffic, size);
  if (is_drawn(message)) keep_drawn(traffic->index, layer, message);
}

void Tap::keep_drawn(uint32_t channel, const std::string& layer, std::span<const uint8_t> message) {
  const std::lock_guard lock(drawn_mutex_);
  std::erase_if(drawn_, [&](const Drawing& before) { return before.layer == layer; });
  if (drawn_.size() >= Drawn::kMostLayers) drawn_.erase(drawn_.begin());
  drawn_.push_back({channel, layer, {message.begin(), message.end()}});
}

std::vector<Tap::Drawing> Tap::take_drawn() {
  const std::lock_guard lock(drawn_mutex_);
  return std::exchange(drawn_, {});
}

bool Tap::takes(const std::string& channel) const {
  const std::lock_guard lock(names_mutex_);
  return inputs_.contains(channel);
}

Traffic* Tap::find(const std::string& channel) {
  const std::lock_guard lock(names_mutex_);
  if (const auto at = by_name_.find(channel); at != by_name_.end())
    return channels_[at->second].get();
  if (channels_.size() >= kMostChannels) return nullptr;
  const size_t index = channels_.size();
  Traffic& added = *channels_.emplace_back(std::make_unique<Traffic>());
  added.name = channel;
  added.index = static_cast<uint32_t>(index);
  by_name_.emplace(channel, static_cast<uint32_t>(index));
  list_[index].store(&added, std::memory_order_release);
  count_.store(index + 1, std::memory_order_release);
  return &added;
}

void Tap::count(Traffic& traffic, size_t size) {
  traffic.messages.fetch_add(1, std::memory_order_relaxed);
  traffic.size.store(static_cast<uint32_t>(size), std::memory_order_relaxed);
}

// Whether the console gets it.
bool Tap::offer(Traffic& traffic, const uint8_t* data, size_t size) {
  count(traffic, size);
  return watched_.load(std::memory_order_relaxed) &&
         traffic.wanted.load(std::memory_order_relaxed) && ring_.offer(traffic.index, data, size);
}

}  // namespace ruedo::console
