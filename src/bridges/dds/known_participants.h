// Limits the number of participants that Cyclone DDS knows, and of their endpoints.
//
// Cyclone's work for each newcomer, and at the end, grows with the square of the number that it
// knows, and a false one costs a sender one datagram. So a socket has its share, as programs have
// one each; so have endpoints of one topic and addresses, of which Cyclone seeks the fewest that
// reach all readers. Without room, the participant that was silent longest is dropped, or the one
// with the most endpoints; Cyclone gets a message that it has left.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>

#include "bridges/dds/discovery_data.h"

namespace ruedo::dds {

inline constexpr size_t kMostParticipants = 256;
// Bytes of all endpoints.
inline constexpr size_t kMostOfEndpoints = size_t{128} << 20;
// From one socket: participants, endpoints of one topic, and addresses to reach them.
inline constexpr size_t kMostOfOneSocket = 32, kMostOfOneTopic = 128, kMostLocators = 64;

using Address = std::array<uint8_t, 20>;  // an IP address and a port

class KnownParticipants {
 public:
  using Clock = std::chrono::steady_clock;

  // Announcements that a participant repeats within this time are ignored.
  static constexpr std::chrono::milliseconds kRepeat{100};
  // A known participant, and one of a socket's, is dropped so often at most.
  static constexpr std::chrono::milliseconds kTurn{20};
  // Cyclone has taken notice of an endpoint by then, on a machine that is busy.
  static constexpr std::chrono::milliseconds kLately{100};

  // This program's own participant, to which messages may be addressed.
  void serve(const Prefix& participant) { own_.insert(participant); }

  // Changes an RTPS message from that address in place: removes announcements that are not allowed.
  void bound(std::span<uint8_t> message, const Address& from, Clock::time_point now);

  // Who has given way, in turn.
  std::optional<Prefix> left();

  size_t size() const { return known_.size(); }

  // Whether a participant that is known has told of that endpoint, and that time ago.
  enum class Told { never, lately, before };
  Told told(const Prefix& who, const std::array<uint8_t, 4>& endpoint, Clock::time_point now) const;

 private:
  // Who announced participants by it, and what they told.
  struct Socket {
    size_t participants = 0;
    std::map<size_t, size_t> endpoints;  // of each topic
    std::set<Locator> locators;
    Clock::time_point next_turn;
  };
  struct Endpoint {
    size_t topic, bytes;
    Clock::time_point told;
  };
  // Fragmented announcements cannot be read: each number counts as an endpoint of its own.
  using EndpointKey = std::pair<Entity, int64_t>;
  struct Known {
    Address from;
    Clock::time_point heard, announced;
    std::map<EndpointKey, Endpoint> endpoints;
    std::map<Entity, int64_t> last;  // what it has told of writers, and of readers
    size_t bytes = 0;
  };
  using Place = std::map<Prefix, Known>::iterator;

  bool is_addressed(const Submessage& part) const;
  void announce(const Submessage& part, const Prefix& who, const Address& from,
                Clock::time_point now);
  bool may_announce(const Prefix& who, const Address& from, Clock::time_point now);
  bool make_room(const Address& from, Clock::time_point now);
  void tell_endpoint(const Submessage& part, const Entity& writer, Place known);
  void tell_fragment(const Submessage& part, const Entity& writer, Place known);
  bool add(Place known, const EndpointKey& key, const Endpoint& endpoint);
  void remove(Place known, const EndpointKey& key);
  void remove_all(Place known);
  void bound_locators(const DiscoveryData& told, const Address& from);
  void make_room_for_endpoints();
  void put_out(Place known);
  void warn_once(std::string_view what);

  std::set<Prefix> own_;
  std::map<Prefix, Known> known_;
  std::map<Address, Socket> sockets_;
  std::deque<Prefix> left_;
  size_t bytes_ = 0;  // of all endpoints
  Clock::time_point next_turn_;
  std::set<std::string_view> warned_;
};

// The RTPS message by which a participant says that it leaves. Returns its size.
size_t write_left(const Prefix& participant, std::span<uint8_t> out);

}  // namespace ruedo::dds
