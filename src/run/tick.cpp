// Ticks: applied commands go with the first part, the manifest is cut at the size of a part.
#include "run/tick.h"

#include <algorithm>

#include "base/crc32.h"
#include "engine/world_state.h"

namespace ruedo::run {

void TickWriter::begin(int64_t utime, int64_t run_id, int32_t epoch, int64_t step) {
  head_.utime = utime;
  head_.run_id = run_id;
  head_.epoch = epoch;
  head_.step = step;
  applied_.clear();
  manifest_.clear();
}

void TickWriter::add_applied(const std::string& client, int64_t sequence) {
  tick_applied_t& entry = applied_.emplace_back();
  entry.client = client;
  entry.sequence = sequence;
}

void TickWriter::add_message(engine::ChannelIndex channel, int64_t sequence, const uint8_t* data,
                             size_t size) {
  tick_message_t& entry = manifest_.emplace_back();
  entry.channel_index = channel;
  entry.sequence = sequence;
  entry.size = static_cast<int32_t>(size);
  entry.crc = static_cast<int32_t>(crc32(data, size));
}

void TickWriter::finish(int64_t state_hash, const std::function<void(const tick_t&)>& publish) {
  constexpr size_t kMessageSize = 4 + 8 + 4 + 4;
  constexpr size_t kInPart = (engine::kMaxPartSize - 16'384) /
                             kMessageSize;  // the rest is for the head and 64 clients' names
  const size_t nparts = std::max<size_t>(1, (manifest_.size() + kInPart - 1) / kInPart);
  for (size_t part = 0; part < nparts; ++part) {
    part_.utime = head_.utime;
    part_.run_id = head_.run_id;
    part_.epoch = head_.epoch;
    part_.step = head_.step;
    part_.state_hash = state_hash;
    part_.part = static_cast<int16_t>(part);
    part_.nparts = static_cast<int16_t>(nparts);
    part_.applied.clear();
    if (part == 0) part_.applied = applied_;
    part_.napplied = static_cast<int32_t>(part_.applied.size());
    const size_t first = part * kInPart, last = std::min(manifest_.size(), first + kInPart);
    part_.manifest.assign(manifest_.begin() + static_cast<std::ptrdiff_t>(first),
                          manifest_.begin() + static_cast<std::ptrdiff_t>(last));
    part_.nmanifest = static_cast<int32_t>(part_.manifest.size());
    publish(part_);
  }
}

}  // namespace ruedo::run
