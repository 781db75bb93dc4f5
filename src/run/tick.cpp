// Ticks: applied commands go with the first part, the manifest is cut at the size of a part.
#include "run/tick.h"

#include <algorithm>
#include <array>

#include "engine/world_state.h"

namespace ruedo::run {

namespace {

// tables[k][b]: what byte b does to the remainder when k more bytes follow it.
using CrcTables = std::array<std::array<uint32_t, 256>, 8>;
constexpr CrcTables kCrc = [] {
  CrcTables tables{};
  for (uint32_t i = 0; i < 256; ++i) {
    uint32_t value = i;
    for (int bit = 0; bit < 8; ++bit) value = value & 1 ? value >> 1 ^ 0xEDB88320u : value >> 1;
    tables[0][i] = value;
  }
  for (size_t k = 1; k < 8; ++k)
    for (size_t i = 0; i < 256; ++i)
      tables[k][i] = tables[0][tables[k - 1][i] & 0xff] ^ tables[k - 1][i] >> 8;
  return tables;
}();

}  // namespace

// Eight bytes at a time ("slicing by 8"; Kounavis, Berry, IEEE Transactions on Computers 57, 2008).
uint32_t crc32(const uint8_t* data, size_t size, uint32_t before) {
  uint32_t crc = ~before;
  for (; size >= 8; data += 8, size -= 8) {
    const uint32_t low = crc ^ (data[0] | data[1] << 8 | data[2] << 16 | uint32_t{data[3]} << 24);
    crc = kCrc[7][low & 0xff] ^ kCrc[6][low >> 8 & 0xff] ^ kCrc[5][low >> 16 & 0xff] ^
          kCrc[4][low >> 24] ^ kCrc[3][data[4]] ^ kCrc[2][data[5]] ^ kCrc[1][data[6]] ^
          kCrc[0][data[7]];
  }
  for (; size > 0; ++data, --size) crc = kCrc[0][(crc ^ *data) & 0xff] ^ crc >> 8;
  return ~crc;
}

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

void TickWriter::add_message(int channel, int64_t sequence, const uint8_t* data, size_t size) {
  tick_message_t& entry = manifest_.emplace_back();
  entry.channel_index = channel;
  entry.sequence = sequence;
  entry.size = static_cast<int32_t>(size);
  entry.crc = static_cast<int32_t>(crc32(data, size));
}

void TickWriter::finish(int64_t state_hash, const std::function<void(const tick_t&)>& publish) {
  constexpr size_t kMessageSize = 4 + 8 + 4 + 4;
  constexpr size_t kInPart =
      (engine::kMaxPartSize - 16'384) / kMessageSize;  // the rest: the head, and 64 clients' names
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
