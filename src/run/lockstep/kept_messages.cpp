// Kept messages, step by step, each step's in one buffer.
#include "run/lockstep/kept_messages.h"

#include <utility>

namespace ruedo::run {

void KeptMessages::begin_step(int64_t step) {
  if (spare_.empty()) {
    steps_.emplace_back();
  } else {
    steps_.push_back(std::move(spare_.back()));
    spare_.pop_back();
  }
  steps_.back().step = step;
}

void KeptMessages::keep(engine::ChannelIndex channel, int64_t sequence, const uint8_t* data,
                        size_t size) {
  KeptStep& step = steps_.back();
  step.entries.push_back({channel, sequence, step.bytes.size(), size});
  step.bytes.insert(step.bytes.end(), data, data + size);
  bytes_ += size;
}

void KeptMessages::forget(int64_t step) {
  while (!steps_.empty() && steps_.front().step <= step) {
    KeptStep old = std::move(steps_.front());
    steps_.pop_front();
    bytes_ -= old.bytes.size();
    old.entries.clear();
    old.bytes.clear();
    if (old.bytes.capacity() > kSpareBytes) std::vector<uint8_t>().swap(old.bytes);
    if (spare_.size() < kMostSteps) spare_.push_back(std::move(old));
  }
}

std::span<const uint8_t> KeptMessages::find(int64_t step, engine::ChannelIndex channel,
                                            int64_t sequence) const {
  if (steps_.empty() || step < steps_.front().step || step > steps_.back().step) return {};
  const KeptStep& kept = steps_[step - steps_.front().step];
  for (const Entry& entry : kept.entries) {
    if (entry.channel == channel && entry.sequence == sequence)
      return {kept.bytes.data() + entry.offset, entry.size};
  }
  return {};
}

}  // namespace ruedo::run
