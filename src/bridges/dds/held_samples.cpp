// RTPS 2.5, 9.4.5 (Data, DataFrag, Gap, Heartbeat).
#include "bridges/dds/held_samples.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "bridges/dds/rtps_message.h"

namespace ruedo::dds {
namespace {

constexpr int64_t kLastSequence = int64_t{1} << 62;
constexpr size_t kShare = kMostHeld / 32;
constexpr size_t kEntry = 128;  // bytes that an entry of a share takes
constexpr size_t kHeartbeatBody = 28;

// Where the writer and the sequence number are; {}: it holds no samples.
std::optional<std::pair<size_t, size_t>> place_of_samples(const Submessage& part) {
  if (part.is_data() || part.is_fragment())
    return std::pair{Submessage::kWriter, Submessage::kSequence};
  constexpr size_t kGapWriter = 8, kGapStart = 12, kGapHead = 20;
  if (part.kind() == Submessage::kGap && part.bytes.size() >= kGapHead)
    return std::pair{kGapWriter, kGapStart};
  return std::nullopt;
}

}  // namespace

std::vector<Samples> samples_in(std::span<uint8_t> message) {
  std::vector<Samples> found;
  if (message.size() < kMessageHeader) return found;
  Sender sender = sender_at(message, kSenderInHead);
  for_each_submessage(message, [&](const Submessage& part) {
    if (part.is_source()) sender = sender_at(part.bytes, Submessage::kSender);
    const auto place = place_of_samples(part);
    if (!place) return;
    ros2::Gid writer{};
    std::copy_n(sender.prefix.begin(), kPrefix, writer.begin());
    std::copy_n(part.bytes.begin() + static_cast<std::ptrdiff_t>(place->first), 4,
                writer.begin() + kPrefix);
    const int64_t sequence = part.sequence(place->second);
    const auto known = std::find_if(found.begin(), found.end(),
                                    [&](const Samples& each) { return each.writer == writer; });
    if (sequence <= 0 || sequence > kLastSequence ||
        (known == found.end() && found.size() == kMostWritersInDatagram))
      return part.erase();
    if (known == found.end())
      found.push_back({writer, sequence});
    else
      known->last = std::max(known->last, sequence);
  });
  return found;
}

size_t write_dropped(const Samples& samples, std::span<uint8_t> out) {
  constexpr uint8_t kFinal = 2;  // no answer is requested
  std::array<uint8_t, kMessageHeader + kSubmessageHeader + kHeartbeatBody> message{
      'R', 'T', 'P', 'S', 2, 1, 1, 16};
  std::copy_n(samples.writer.begin(), kPrefix, message.begin() + 8);
  uint8_t* heartbeat = message.data() + kMessageHeader;
  heartbeat[0] = Submessage::kHeartbeat;
  heartbeat[1] = Submessage::kLittleEndian | kFinal;
  heartbeat[2] = kHeartbeatBody;
  std::copy_n(samples.writer.begin() + kPrefix, 4, heartbeat + 8);
  const auto put = [&](size_t at, int64_t sequence) {
    const auto high = static_cast<uint32_t>(sequence >> 32), low = static_cast<uint32_t>(sequence);
    for (size_t i = 0; i < 4; ++i) {
      heartbeat[at + i] = static_cast<uint8_t>(high >> 8 * i);
      heartbeat[at + 4 + i] = static_cast<uint8_t>(low >> 8 * i);
    }
  };
  put(12, samples.last + 1);  // the first that it has
  put(20, samples.last);      // the last: none
  if (out.size() < message.size()) return 0;
  std::copy(message.begin(), message.end(), out.begin());
  return message.size();
}

void HeldSamples::add(size_t bytes, std::span<const Samples> samples) {
  if (samples.empty()) return;
  if (shares_.empty() || shares_.back().bytes >= kShare) shares_.emplace_back();
  Share& share = shares_.back();
  for (const Samples& each : samples) {
    const auto [last, fresh] = share.last_of.try_emplace(each.writer, each.last);
    last->second = std::max(last->second, each.last);
    if (fresh) bytes += kEntry;
  }
  share.bytes += bytes;
  bytes_ += bytes;
}

std::optional<Samples> HeldSamples::overdue() {
  while (bytes_ > kMostHeld) {
    Share& oldest = shares_.front();
    if (const auto next = oldest.last_of.begin(); next != oldest.last_of.end()) {
      const Samples samples{next->first, next->second};
      oldest.last_of.erase(next);
      return samples;
    }
    bytes_ -= oldest.bytes;
    shares_.pop_front();
  }
  return std::nullopt;
}

}  // namespace ruedo::dds
