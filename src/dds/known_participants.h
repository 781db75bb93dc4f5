// Bounds how many participants Cyclone DDS knows, and how much of their endpoints.
//
// Cyclone's work for each newcomer, and at the end, grows with the square of the number that it
// knows, and a false one costs a stranger one datagram. So a socket has its share, as programs have
// one each. Where there is no room, who was not heard for longest gives way, or who has the most
// endpoints; Cyclone is told that it has left.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>

#include "dds/rtps_message.h"

namespace ruedo::dds {

inline constexpr size_t kMostParticipants = 256;
inline constexpr size_t kMostOfOneSocket = 32;
// Bytes of what is told of one participant or endpoint, and of all endpoints of all.
inline constexpr size_t kMostTold = size_t{16} << 10, kMostOfAll = size_t{128} << 20;

using Prefix =
    std::array<uint8_t, kPrefix>;         // of the GUIDs of a participant and of all its endpoints
using Entity = std::array<uint8_t, 4>;    // the rest of a GUID
using Address = std::array<uint8_t, 20>;  // an IP address and a port

class KnownParticipants {
 public:
  using Clock = std::chrono::steady_clock;

  // What a participant announces again before that is passed over.
  static constexpr std::chrono::milliseconds kRepeat{100};
  // One of those known gives way so often at most.
  static constexpr std::chrono::milliseconds kTurn{20};

  // Changes an RTPS message from that address in place: what may not be told becomes nothing.
  void bound(std::span<uint8_t> message, const Address& from, Clock::time_point now);

  // Who has given way, in turn.
  std::optional<Prefix> left();

  size_t size() const { return known_.size(); }

 private:
  struct Known {
    Address from;
    Clock::time_point heard, announced;
    std::map<Entity, size_t> endpoints;  // bytes of each
    size_t bytes = 0;
  };
  using Place = std::map<Prefix, Known>::iterator;

  void announce(const Submessage& part, const Prefix& who, const Address& from,
                Clock::time_point now);
  void tell_endpoint(const Submessage& part, const Prefix& who);
  void tell_fragment(const Submessage& part, const Prefix& who);
  void count(const Prefix& who, const Entity& endpoint, size_t bytes);
  void forget(Place known);
  void put_out(Place known);
  bool may_announce(const Prefix& who, const Address& from, Clock::time_point now);
  bool make_room(const Address& from, Clock::time_point now);

  std::map<Prefix, Known> known_;
  std::deque<Prefix> left_;
  size_t bytes_ = 0;  // of all endpoints
  Clock::time_point next_turn_;
};

// The RTPS message by which a participant says that it leaves. Returns its size.
size_t write_left(const Prefix& participant, std::span<uint8_t> out);

}  // namespace ruedo::dds
