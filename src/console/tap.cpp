// The way past the publisher: counted, copied where wanted, never waited for.
#include "console/tap.h"

namespace ruedo::console {

void Tap::announce(const std::shared_ptr<const run::Announcement>& announcement) {
  const auto& channels = announcement->channels.list();
  by_index_.assign(channels.size(), nullptr);
  const std::lock_guard lock(names_mutex_);
  inputs_.clear();
  for (const engine::Channel& channel : channels) {
    if (channel.input && !channel.gone) inputs_.insert(channel.bus_name);
  }
}

void Tap::message(const run::Published& message) {
  Traffic*& traffic = by_index_[message.index];
  if (!traffic) traffic = find(message.channel);
  if (traffic) offer(*traffic, message.data, message.size);
}

void Tap::hear(const std::string& channel, const uint8_t* data, size_t size) {
  if (Traffic* traffic = find(channel)) offer(*traffic, data, size);
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

void Tap::offer(Traffic& traffic, const uint8_t* data, size_t size) {
  traffic.messages.fetch_add(1, std::memory_order_relaxed);
  traffic.size.store(static_cast<uint32_t>(size), std::memory_order_relaxed);
  if (watched_.load(std::memory_order_relaxed) && traffic.wanted.load(std::memory_order_relaxed))
    ring_.offer(traffic.index, data, size);
}

}  // namespace ruedo::console
