// The way past the publisher: counted, copied where wanted, never waited for.
#include "console/tee_bus.h"

namespace ruedo::console {

void TeeBus::publish(const std::string& channel, const uint8_t* data, size_t size) {
  inner_.publish(channel, data, size);
  offer(channel, data, size);
}

void TeeBus::listen(const std::vector<std::string>& channels, Handler handler,
                    const std::vector<std::string>& own) {
  {
    const std::lock_guard lock(handler_mutex_);
    handler_ = std::move(handler);
  }
  allow(channels);  // what is allowed is heard
  inner_.listen(
      channels,
      [this](const std::string& channel, const uint8_t* data, size_t size) {
        receive(channel, data, size);
      },
      own);
}

void TeeBus::listen_to(const std::vector<std::string>& channels,
                       const std::vector<std::string>& own) {
  allow(channels);
  inner_.listen_to(channels, own);
}

void TeeBus::stop() {
  inner_.stop();
  const std::lock_guard lock(handler_mutex_);
  handler_ = nullptr;
}

void TeeBus::receive(const std::string& channel, const uint8_t* data, size_t size) {
  {
    const std::lock_guard lock(handler_mutex_);
    if (handler_) handler_(channel, data, size);
  }
  offer(channel, data, size);
}

void TeeBus::allow(const std::vector<std::string>& channels) {
  const std::lock_guard lock(inputs_mutex_);
  inputs_ = {channels.begin(), channels.end()};
}

bool TeeBus::command(const std::string& channel, const uint8_t* data, size_t size) {
  {
    const std::lock_guard lock(inputs_mutex_);
    if (!inputs_.contains(channel)) return false;
  }
  receive(channel, data, size);
  return true;
}

Traffic* TeeBus::find(const std::string& channel) {
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

void TeeBus::offer(const std::string& channel, const uint8_t* data, size_t size) {
  if (offering_.test_and_set(std::memory_order_acquire)) return;
  if (Traffic* traffic = find(channel)) {
    traffic->messages.store(traffic->messages.load(std::memory_order_relaxed) + 1,
                            std::memory_order_relaxed);
    traffic->size.store(static_cast<uint32_t>(size), std::memory_order_relaxed);
    if (watched_.load(std::memory_order_relaxed) &&
        traffic->wanted.load(std::memory_order_relaxed)) {
      ring_.offer(traffic->index, data, size);
    }
  }
  offering_.clear(std::memory_order_release);
}

}  // namespace ruedo::console
