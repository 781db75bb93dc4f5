// A bus that forwards to another one; a node sees what goes over it, and speaks as if it were on it.
#pragma once

#include <atomic>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "ros2/node.h"
#include "ruedo/bus.h"

namespace ruedo::ros2 {

class TapBus : public Bus {
 public:
  explicit TapBus(Bus& inner) : inner_(inner) {}

  void attach(Node* node) { node_ = node; }

  void publish(const std::string& channel, const uint8_t* data, size_t size) override {
    inner_.publish(channel, data, size);
    if (Node* node = node_) node->offer(channel, data, size);
  }
  void listen(const std::vector<std::string>& channels, Handler handler, const std::vector<std::string>& own = {}) override {
    {
      const std::lock_guard lock(mutex_);
      handler_ = std::move(handler);
    }
    inner_.listen(channels, [this](const std::string& channel, const uint8_t* data, size_t size) { inject(channel, {data, size}); }, own);
  }
  void listen_to(const std::vector<std::string>& channels, const std::vector<std::string>& own = {}) override { inner_.listen_to(channels, own); }
  void flush() override { inner_.flush(); }
  void stop() override {
    inner_.stop();
    const std::lock_guard lock(mutex_);
    handler_ = nullptr;
  }
  uint64_t failed() const override { return inner_.failed(); }

  // As if it had come over the bus. Any thread.
  void inject(const std::string& channel, std::span<const uint8_t> message) {
    const std::lock_guard lock(mutex_);
    if (handler_) handler_(channel, message.data(), message.size());
  }

 private:
  Bus& inner_;
  std::atomic<Node*> node_{nullptr};
  std::mutex mutex_;    // the bus's thread and the node's take turns
  Handler handler_;
};

}  // namespace ruedo::ros2
