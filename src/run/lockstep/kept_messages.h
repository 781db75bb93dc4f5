// The messages of the last steps, for clients that have lost some: kept until all have received
// them.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "run/sink.h"

namespace ruedo::run {

class KeptMessages : public Sink {
 public:
  static constexpr size_t kMostSteps = 128;
  static constexpr size_t kMostBytes = 32u << 20;

  // Samples, and the ticks.
  Hears hears() const override { return {.samples = true, .services = true}; }
  void announce(const std::shared_ptr<const Announcement>& announcement) override {
    tick_ = announcement->own.tick;
  }
  void begin_step(const Step& step) override { begin_step(step.step); }
  void message(const Published& message) override {
    if (message.kind == Kind::sample || message.index == tick_)
      keep(message.index, message.sequence, message.data, message.size);
  }

  // Steps follow on one another. keep() belongs to the last one.
  void begin_step(int64_t step);
  void keep(engine::ChannelIndex channel, int64_t sequence, const uint8_t* data, size_t size);

  void forget(int64_t step);  // all up to and with that one
  void clear() { forget(INT64_MAX); }

  // One batch of steps may exceed it; the caller then takes no other.
  bool full() const { return steps_.size() >= kMostSteps || bytes_ >= kMostBytes; }
  bool empty() const { return steps_.empty(); }
  size_t bytes() const { return bytes_; }

  // Empty when it is not there; valid until the next call that changes something.
  std::span<const uint8_t> find(int64_t step, engine::ChannelIndex channel, int64_t sequence) const;

 private:
  struct Entry {
    engine::ChannelIndex channel;
    int64_t sequence;
    size_t offset, size;
  };
  struct KeptStep {
    int64_t step = 0;
    std::vector<Entry> entries;
    std::vector<uint8_t> bytes;
  };
  static constexpr size_t kSpareBytes = 64u
                                        << 10;  // a buffer larger than this goes back to the system

  engine::ChannelIndex tick_;
  std::deque<KeptStep> steps_;
  std::vector<KeptStep> spare_;  // their memory is used again
  size_t bytes_ = 0;
};

}  // namespace ruedo::run
