// A bus that forwards to another one and lets the console see what goes over it.
//
// Who publishes pays a look-up and two counters a message, and a copy of those that a viewer
// watches. It waits for nothing: when two threads publish in the same moment, or the ring is full,
// the console misses a message.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "console/offer_ring.h"
#include "ruedo/bus.h"

namespace ruedo::console {

// What has gone over a channel so far.
struct Traffic {
  std::string name;
  uint32_t index = 0;  // its number among the channels
  std::atomic<uint64_t> messages{0};
  std::atomic<uint32_t> size{0};   // bytes, of the newest
  std::atomic<bool> wanted{true};  // its messages are offered; until the console says otherwise
};

class TeeBus : public Bus {
 public:
  static constexpr size_t kMostChannels = 65536;  // more are forwarded, and not shown
  static constexpr size_t kRingSize = size_t{1} << 25;

  explicit TeeBus(Bus& inner) : inner_(inner) {}

  void publish(const std::string& channel, const uint8_t* data, size_t size) override;
  void listen(const std::vector<std::string>& channels, Handler handler,
              const std::vector<std::string>& own = {}) override;
  void listen_to(const std::vector<std::string>& channels,
                 const std::vector<std::string>& own = {}) override;
  void flush() override { inner_.flush(); }
  void stop() override;
  uint64_t failed() const override { return inner_.failed(); }

  // The console's. A command or request of a viewer's goes straight to who listens to the bus: a
  // bus need not hear what this process sends. False for a channel without a listener.
  bool command(const std::string& channel, const uint8_t* data, size_t size);

  // Whether anybody watches; without that, messages are only counted.
  void watch(bool on) { watched_.store(on, std::memory_order_relaxed); }

  size_t channel_count() const { return count_.load(std::memory_order_acquire); }
  Traffic& channel(size_t index) const { return *list_[index].load(std::memory_order_acquire); }
  OfferRing& ring() { return ring_; }

 private:
  void receive(const std::string& channel, const uint8_t* data, size_t size);
  void offer(const std::string& channel, const uint8_t* data, size_t size);
  Traffic* find(const std::string& channel);
  void allow(const std::vector<std::string>& channels);

  Bus& inner_;
  OfferRing ring_{kRingSize};
  std::atomic<bool> watched_{false};

  std::atomic_flag offering_ = ATOMIC_FLAG_INIT;       // who has it may use what follows
  std::unordered_map<std::string, uint32_t> by_name_;  // looked up only
  std::vector<std::unique_ptr<Traffic>> channels_;
  std::unique_ptr<std::atomic<Traffic*>[]> list_{new std::atomic<Traffic*>[kMostChannels]};
  std::atomic<size_t> count_{0};

  std::mutex inputs_mutex_;
  std::unordered_set<std::string> inputs_;

  std::mutex handler_mutex_;  // the bus's thread and the console's take turns
  Handler handler_;
};

}  // namespace ruedo::console
