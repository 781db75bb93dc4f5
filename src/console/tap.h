// Collects a run's traffic for the console: messages that it publishes, and the commands and
// requests that reach it by any route.
//
// The publisher pays two counters per message, and a copy of those that a viewer watches and of the
// newest state of the bodies. It never waits: when the ring is full, the console misses a message.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "console/offer_ring.h"
#include "run/sink.h"

namespace ruedo::console {

// The traffic on a channel since the start.
struct Traffic {
  std::string name;
  uint32_t index = 0;  // its number among the channels
  std::atomic<uint64_t> messages{0};
  std::atomic<uint32_t> size{0};   // bytes, of the newest
  std::atomic<bool> wanted{true};  // whether its messages are offered; set by the console
};

class Tap : public run::Sink {
 public:
  // The drawing of a client (markers_t).
  struct Drawing {
    uint32_t channel;
    std::string layer;
    std::vector<uint8_t> message;
  };
  static constexpr size_t kMostChannels = 65536;  // further ones are not shown
  static constexpr size_t kRingSize = size_t{1} << 25;

  // For the run; in the publisher's thread.
  Hears hears() const override { return {.samples = true, .services = true}; }
  void announce(const std::shared_ptr<const run::Announcement>& announcement) override;
  void message(const run::Published& message) override;

  // A command or request that reached the run, before it is handled. Any thread.
  void hear(const std::string& channel, const uint8_t* data, size_t size);

  // The rest is for the console.

  // Whether the run accepts commands or requests on it.
  bool takes(const std::string& channel) const;

  // Whether anybody watches; otherwise messages are only counted.
  void watch(bool on) { watched_.store(on, std::memory_order_relaxed); }

  size_t channel_count() const { return count_.load(std::memory_order_acquire); }
  Traffic& channel(size_t index) const { return *list_[index].load(std::memory_order_acquire); }
  OfferRing& ring() { return ring_; }
  // The drawings since the last call, the newest of each layer: also without a viewer, for later
  // viewers.
  std::vector<Drawing> take_drawn();

  // The newest state of the bodies.
  struct State {
    uint32_t channel = 0;
    std::vector<std::vector<uint8_t>> parts;
  };
  // The state, if it was neither offered nor read before: a paused run sends no further one to new
  // viewers. Empty without one, or if its channel is beyond the limit.
  State take_state(size_t channels);

 private:
  Traffic* find(const std::string& channel);  // null: there are too many
  static void count(Traffic& traffic, size_t size);
  bool offer(Traffic& traffic, const uint8_t* data, size_t size);
  void keep_state(uint32_t channel, std::span<const uint8_t> part, bool offered);

  void keep_drawn(uint32_t channel, const std::string& layer, std::span<const uint8_t> message);

  OfferRing ring_{kRingSize};
  std::mutex drawn_mutex_;
  std::vector<Drawing> drawn_;
  std::mutex state_mutex_;
  State state_;
  bool state_was_told_ = true;        // the console has it, or will find it in the ring
  engine::ChannelIndex state_index_;  // in the announcement. Publisher's thread
  std::atomic<bool> watched_{false};
  // by index in the announcement; null: not heard yet. Publisher's thread
  std::vector<Traffic*> by_index_;

  mutable std::mutex names_mutex_;                     // held for a look-up, and to add a channel
  std::unordered_map<std::string, uint32_t> by_name_;  // looked up only
  std::unordered_set<std::string> inputs_;
  std::vector<std::unique_ptr<Traffic>> channels_;

  std::unique_ptr<std::atomic<Traffic*>[]> list_{new std::atomic<Traffic*>[kMostChannels]};
  std::atomic<size_t> count_{0};
};

}  // namespace ruedo::console
