// RTPS 2.5, 8.5.3 (SPDP), 8.5.4 (SEDP), 9.4.2.11 (parameter lists), 9.6 (what they contain).
#include "dds/known_participants.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "dds/rtps_message.h"

namespace ruedo::dds {
namespace {

using Bytes = std::span<uint8_t>;

constexpr Entity kParticipant{0, 0, 1, 0xc1}, kAnnouncer{0, 1, 0, 0xc2},
    kSecureAnnouncer{0xff, 1, 1, 0xc2}, kOfWriters{0, 0, 3, 0xc2}, kOfReaders{0, 0, 4, 0xc2};
// Products of a vendor that tell of other participants.
constexpr std::array<uint8_t, 2> kTellsOfOthers{1, 0x20};

constexpr Entity kFragments{};      // stands for all endpoints that are told of in fragments
constexpr size_t kEndpoint = 2048;  // bytes that Cyclone needs for an endpoint

constexpr uint8_t kHasInlineQos = 2, kHasPayload = 4, kHasKey = 8;  // flags of a DATA
constexpr uint8_t kBigEndianList = 2, kLittleEndianList = 3;        // encodings of a payload

enum Parameter : uint16_t {
  kPad = 0,
  kSentinel = 1,
  kParticipantGuid = 0x50,
  kEndpointGuid = 0x5a,
  kKeyHash = 0x70,
  kStatus = 0x71,
  kServes = 0x8007,  // Cyclone's: among others, whether it tells of other participants
};

uint32_t number_at(Bytes bytes, size_t at, size_t size, bool little) {
  uint32_t value = 0;
  for (size_t i = 0; i < size; ++i)
    value |= uint32_t{bytes[at + i]} << 8 * (little ? i : size - 1 - i);
  return value;
}

// Calls what(parameter with its head, id, value). Where the list ends; none: it does not.
template <class Do>
std::optional<size_t> for_each_parameter(Bytes list, bool little, Do what) {
  for (size_t at = 0; at + 4 <= list.size();) {
    const uint32_t id = number_at(list, at, 2, little), size = number_at(list, at + 2, 2, little);
    if (id == kSentinel) return at + 4;
    if (at + 4 + size > list.size()) return std::nullopt;
    what(list.subspan(at, 4 + size), id, list.subspan(at + 4, size));
    at += 4 + size;
  }
  return std::nullopt;
}

// What a DATA of discovery tells.
struct Told {
  Prefix who;  // tells it
  bool of_own = false, of_others = false, leaves = false;
  Entity endpoint{};

  void take_guid(Bytes value) {
    if (value.size() < kPrefix + endpoint.size()) return;
    (std::equal(who.begin(), who.end(), value.begin()) ? of_own : of_others) = true;
    std::copy_n(value.begin() + kPrefix, endpoint.size(), endpoint.begin());
  }
  bool take_inline_qos(const Submessage& part, Bytes& rest) {
    const auto end =
        for_each_parameter(rest, part.is_little_endian(), [&](Bytes, uint32_t id, Bytes value) {
          if (id == kKeyHash) take_guid(value);
          if (id == kStatus && value.size() >= 4) leaves = (value[3] & 3) != 0;
        });
    rest = rest.subspan(end.value_or(0));
    return end.has_value();
  }
  bool take_payload(Bytes payload, uint32_t guid) {
    if (payload.size() < 4 || payload[0] != 0) return false;
    const bool little = payload[1] == kLittleEndianList;
    if (!little && payload[1] != kBigEndianList) return false;
    const auto take = [&](Bytes parameter, uint32_t id, Bytes value) {
      if (id == guid) take_guid(value);
      if (id == kServes) std::fill_n(parameter.begin(), 2, static_cast<uint8_t>(kPad));
    };
    return for_each_parameter(payload.subspan(4), little, take).has_value();
  }
};

// guid: the parameter that says of whom it is told. None: it cannot be read, is too much, or is
// told of another.
std::optional<Told> told_in(const Submessage& part, const Prefix& who, uint32_t guid) {
  constexpr size_t kOffset = 6;  // of what follows it
  const size_t begin = kOffset + 2 + part.number(kOffset, 2);
  if (begin > part.bytes.size() || part.bytes.size() > kMostTold) return std::nullopt;
  Bytes rest = part.bytes.subspan(begin);
  const uint8_t flags = part.bytes[1];
  Told told{who};
  const bool is_whole = (!(flags & kHasInlineQos) || told.take_inline_qos(part, rest)) &&
                        (!(flags & (kHasPayload | kHasKey)) || told.take_payload(rest, guid));
  return is_whole && told.of_own && !told.of_others ? std::optional(told) : std::nullopt;
}

}  // namespace

void KnownParticipants::bound(std::span<uint8_t> message, const Address& from,
                              Clock::time_point now) {
  if (message.size() < kMessageHeader) return;
  Prefix who{};
  std::copy_n(message.begin() + 8, who.size(), who.begin());
  if (const auto known = known_.find(who); known != known_.end()) known->second.heard = now;
  bool of_others = std::equal(kTellsOfOthers.begin(), kTellsOfOthers.end(), message.begin() + 6);
  for_each_submessage(message, [&](const Submessage& part) {
    of_others = of_others || part.kind() == Submessage::kInfoSource;
    if (of_others) return part.erase();
    if (!part.is_data() && !part.is_fragment()) return;
    Entity writer{};
    std::copy_n(part.bytes.begin() + Submessage::kWriter, writer.size(), writer.begin());
    if (writer == kSecureAnnouncer || (writer == kAnnouncer && part.is_fragment()))
      part.erase();
    else if (writer == kAnnouncer)
      announce(part, who, from, now);
    else if (writer == kOfWriters || writer == kOfReaders)
      part.is_data() ? tell_endpoint(part, who) : tell_fragment(part, who);
  });
}

void KnownParticipants::announce(const Submessage& part, const Prefix& who, const Address& from,
                                 Clock::time_point now) {
  const std::optional<Told> told = told_in(part, who, kParticipantGuid);
  if (!told) return part.erase();
  if (!told->leaves) {
    if (!may_announce(who, from, now)) part.erase();
  } else if (const auto known = known_.find(who); known != known_.end()) {
    forget(known);
  }
}

void KnownParticipants::tell_endpoint(const Submessage& part, const Prefix& who) {
  const std::optional<Told> told = told_in(part, who, kEndpointGuid);
  if (!told) return part.erase();
  count(who, told->endpoint, told->leaves ? 0 : kEndpoint + part.bytes.size());
}

// It is not whole, so that who tells of an endpoint again is taken to tell of another.
void KnownParticipants::tell_fragment(const Submessage& part, const Prefix& who) {
  const size_t size = part.number(Submessage::kSampleSize, 4);
  if (size > kMostTold) return part.leave_out();
  if (part.number(Submessage::kFirstFragment, 4) != 1) return;
  if (const auto known = known_.find(who); known != known_.end())
    count(who, kFragments, known->second.endpoints[kFragments] + kEndpoint + size);
}

void KnownParticipants::count(const Prefix& who, const Entity& endpoint, size_t bytes) {
  const auto known = known_.find(who);
  if (known == known_.end()) return;
  size_t& before = known->second.endpoints[endpoint];
  known->second.bytes += bytes - before;
  bytes_ += bytes - before;
  before = bytes;
  if (bytes == 0) known->second.endpoints.erase(endpoint);
  if (bytes_ <= kMostOfAll) return;
  put_out(std::max_element(known_.begin(), known_.end(), [](const auto& a, const auto& b) {
    return a.second.bytes < b.second.bytes;
  }));
}

void KnownParticipants::forget(Place known) {
  bytes_ -= known->second.bytes;
  known_.erase(known);
}

void KnownParticipants::put_out(Place known) {
  left_.push_back(known->first);
  forget(known);
}

bool KnownParticipants::may_announce(const Prefix& who, const Address& from,
                                     Clock::time_point now) {
  if (const auto known = known_.find(who); known != known_.end()) {
    if (now < known->second.announced + kRepeat) return false;
    known->second.announced = now;
    return true;
  }
  if (!make_room(from, now)) return false;
  known_[who] = {from, now, now, {}, 0};
  return true;
}

bool KnownParticipants::make_room(const Address& from, Clock::time_point now) {
  const auto of_socket = [&](const auto& each) { return each.second.from == from; };
  const bool has_share = static_cast<size_t>(std::count_if(known_.begin(), known_.end(),
                                                           of_socket)) >= kMostOfOneSocket;
  if (!has_share && known_.size() < kMostParticipants) return true;
  if (now < next_turn_) return false;
  next_turn_ = now + kTurn;
  const auto silent =
      std::min_element(known_.begin(), known_.end(), [&](const auto& a, const auto& b) {
        if (has_share && of_socket(a) != of_socket(b)) return of_socket(a);
        return a.second.heard < b.second.heard;
      });
  put_out(silent);
  return true;
}

std::optional<Prefix> KnownParticipants::left() {
  if (left_.empty()) return std::nullopt;
  const Prefix next = left_.front();
  left_.pop_front();
  return next;
}

size_t write_left(const Prefix& participant, std::span<uint8_t> out) {
  std::vector<uint8_t> message{'R', 'T', 'P', 'S', 2, 1, 1, 16};
  const auto add = [&](std::initializer_list<uint8_t> bytes) {
    message.insert(message.end(), bytes);
  };
  const auto add_all = [&](const auto& bytes) {
    message.insert(message.end(), bytes.begin(), bytes.end());
  };
  add_all(participant);
  add({Submessage::kData, Submessage::kLittleEndian | kHasInlineQos | kHasKey, 60, 0});
  add({0, 0, 16, 0, 0, 0, 0, 0});
  add_all(kAnnouncer);
  add({0, 0, 0, 0, 1, 0, 0, 0});                            // the sequence number
  add({kStatus, 0, 4, 0, 0, 0, 0, 3, kSentinel, 0, 0, 0});  // disposed and unregistered
  add({0, kLittleEndianList, 0, 0, kParticipantGuid, 0, 16, 0});
  add_all(participant);
  add_all(kParticipant);
  add({kSentinel, 0, 0, 0});
  if (out.size() < message.size()) return 0;
  std::copy(message.begin(), message.end(), out.begin());
  return message.size();
}

}  // namespace ruedo::dds
