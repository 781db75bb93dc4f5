// Checks announcements of participants and endpoints, and limits their cost (RTPS 2.5, 8.5).
#include "bridges/dds/known_participants.h"

#include <algorithm>
#include <initializer_list>
#include <vector>

#include <spdlog/spdlog.h>

namespace ruedo::dds {
namespace {

// Products of a vendor that announce other participants.
constexpr std::array<uint8_t, 2> kTellsOfOthers{1, 0x20};
constexpr size_t kFragmentsTopic = 0;
constexpr size_t kEndpoint = 2048;  // bytes that Cyclone needs for an endpoint

}  // namespace

void KnownParticipants::bound(std::span<uint8_t> message, const Address& from,
                              Clock::time_point now) {
  if (message.size() < kMessageHeader) return;
  Sender sender;
  const auto turn_to = [&](const Sender& next) {
    sender = next;
    if (const auto known = known_.find(next.prefix); known != known_.end())
      known->second.heard = now;
  };
  turn_to(sender_at(message, kSenderInHead));
  bool to_others = false;
  for_each_submessage(message, [&](const Submessage& part) {
    if (part.is_source()) return turn_to(sender_at(part.bytes, Submessage::kSender));
    if (sender.vendor == kTellsOfOthers) return part.erase();
    if (part.kind() == Submessage::kInfoDestination) to_others = !is_addressed(part);
    if (!part.is_data() && !part.is_fragment()) return;
    Entity writer{};
    std::copy_n(part.bytes.begin() + Submessage::kWriter, writer.size(), writer.begin());
    const bool announces = writer == kAnnouncer || writer == kSecureAnnouncer,
               tells = writer == kOfWriters || writer == kOfReaders;
    if (!announces && !tells) return;
    if (to_others || (announces && (part.is_fragment() || writer == kSecureAnnouncer)))
      return part.erase();
    if (announces) return announce(part, sender.prefix, from, now);
    const auto known = known_.find(sender.prefix);
    if (known == known_.end()) return;
    part.is_data() ? tell_endpoint(part, writer, known) : tell_fragment(part, writer, known);
  });
}

KnownParticipants::Told KnownParticipants::told(const Prefix& who,
                                                const std::array<uint8_t, 4>& endpoint,
                                                Clock::time_point now) const {
  const auto known = known_.find(who);
  if (known == known_.end()) return Told::before;
  const auto found = known->second.endpoints.find({endpoint, 0});
  if (found == known->second.endpoints.end()) return Told::never;
  return now < found->second.told + kLately ? Told::lately : Told::before;
}

// Whether what follows is for this program, or for all.
bool KnownParticipants::is_addressed(const Submessage& part) const {
  Prefix to{};
  if (part.bytes.size() < kSubmessageHeader + to.size()) return false;
  std::copy_n(part.bytes.begin() + kSubmessageHeader, to.size(), to.begin());
  return to == Prefix{} || own_.contains(to);
}

void KnownParticipants::announce(const Submessage& part, const Prefix& who, const Address& from,
                                 Clock::time_point now) {
  const auto told = discovery_data(part, who, kParticipantGuid);
  if (!told) return part.erase();
  if (!told->leaves) {
    if (!may_announce(who, from, now)) return part.erase();
    bound_locators(*told, known_.at(who).from);
  } else if (const auto known = known_.find(who); known != known_.end()) {
    // Cyclone may have missed it, so that it keeps its place until another needs it.
    remove_all(known);
    known->second.heard = known->second.announced = {};
  }
}

bool KnownParticipants::may_announce(const Prefix& who, const Address& from,
                                     Clock::time_point now) {
  if (const auto known = known_.find(who); known != known_.end()) {
    if (now < known->second.announced + kRepeat) return false;
    known->second.announced = now;
    return true;
  }
  if (!make_room(from, now)) return false;
  known_[who] = {from, now, now, {}, {}, 0};
  ++sockets_[from].participants;
  return true;
}

bool KnownParticipants::make_room(const Address& from, Clock::time_point now) {
  const auto socket = sockets_.find(from);
  const bool has_share =
      socket != sockets_.end() && socket->second.participants >= kMostOfOneSocket;
  if (!has_share && known_.size() < kMostParticipants) return true;
  Clock::time_point& next_turn = has_share ? socket->second.next_turn : next_turn_;
  if (now < next_turn) return false;
  next_turn = now + kTurn;
  warn_once(has_share ? "more than 32 participants come from one socket: the most silent give way"
                      : "there are more than 256 participants: the most silent give way");
  put_out(std::min_element(known_.begin(), known_.end(), [&](const auto& a, const auto& b) {
    const bool of_socket = a.second.from == from;
    if (has_share && of_socket != (b.second.from == from)) return of_socket;
    return a.second.heard < b.second.heard;
  }));
  return true;
}

void KnownParticipants::tell_endpoint(const Submessage& part, const Entity& writer, Place known) {
  const auto told = discovery_data(part, known->first, kEndpointGuid);
  if (!told) return part.erase();
  const EndpointKey key{told->entity, 0};
  const int64_t sequence = part.sequence(Submessage::kSequence);
  int64_t& last = known->second.last[writer];
  const bool is_new = sequence > last;  // Cyclone passes over what it has had
  last = std::max(last, sequence);
  if (told->leaves) {
    if (is_new) remove(known, key);
    return;
  }
  if (!add(known, key, {told->topic, kEndpoint + part.bytes.size(), {}})) return part.erase();
  bound_locators(*told, known->second.from);
  make_room_for_endpoints();
}

void KnownParticipants::tell_fragment(const Submessage& part, const Entity& writer, Place known) {
  const size_t size = part.number(Submessage::kSampleSize, 4);
  const EndpointKey key{writer, part.sequence(Submessage::kSequence)};
  if (size > kMostTold || !add(known, key, {kFragmentsTopic, kEndpoint + size, {}}))
    return part.leave_out();
  make_room_for_endpoints();
}

// False: the socket has its share of the topic. An endpoint stays in its topic.
bool KnownParticipants::add(Place known, const EndpointKey& key, const Endpoint& endpoint) {
  auto before = known->second.endpoints.find(key);
  if (before == known->second.endpoints.end()) {
    size_t& count = sockets_[known->second.from].endpoints[endpoint.topic];
    if (count >= kMostOfOneTopic) {
      warn_once(
          "more than 128 readers or writers of a topic are at one socket: not all are served");
      return false;
    }
    ++count;
    before =
        known->second.endpoints.try_emplace(key, Endpoint{endpoint.topic, 0, known->second.heard})
            .first;
  }
  if (const size_t more = std::max(before->second.bytes, endpoint.bytes) - before->second.bytes) {
    before->second.bytes += more;
    known->second.bytes += more;
    bytes_ += more;
  }
  return true;
}

void KnownParticipants::remove(Place known, const EndpointKey& key) {
  const auto endpoint = known->second.endpoints.find(key);
  if (endpoint == known->second.endpoints.end()) return;
  auto& endpoints = sockets_[known->second.from].endpoints;
  if (const auto topic = endpoints.find(endpoint->second.topic); --topic->second == 0)
    endpoints.erase(topic);
  known->second.bytes -= endpoint->second.bytes;
  bytes_ -= endpoint->second.bytes;
  known->second.endpoints.erase(endpoint);
}

void KnownParticipants::remove_all(Place known) {
  while (!known->second.endpoints.empty()) remove(known, known->second.endpoints.begin()->first);
}

void KnownParticipants::bound_locators(const DiscoveryData& told, const Address& from) {
  std::set<Locator>& known = sockets_[from].locators;
  for (const ToldLocator& each : told.locators) {
    if (known.size() < kMostLocators) {
      known.insert(each.locator);
    } else if (!known.contains(each.locator)) {
      each.erase();
      warn_once("a participant announces more than 64 addresses; the rest is ignored");
    }
  }
}

void KnownParticipants::make_room_for_endpoints() {
  if (bytes_ <= kMostOfEndpoints) return;
  warn_once("endpoints need more than 128 MB: the participant with the most gives way");
  put_out(std::max_element(known_.begin(), known_.end(), [](const auto& a, const auto& b) {
    return a.second.bytes < b.second.bytes;
  }));
}

void KnownParticipants::put_out(Place known) {
  left_.push_back(known->first);
  remove_all(known);
  const auto socket = sockets_.find(known->second.from);
  if (--socket->second.participants == 0) sockets_.erase(socket);
  known_.erase(known);
}

void KnownParticipants::warn_once(std::string_view what) {
  if (warned_.insert(what).second) spdlog::warn("ROS 2: {}", what);
}

std::optional<Prefix> KnownParticipants::left() {
  if (left_.empty()) return std::nullopt;
  const Prefix next = left_.front();
  left_.pop_front();
  return next;
}

size_t write_left(const Prefix& participant, std::span<uint8_t> out) {
  constexpr uint8_t kLittleEndianList = 3;
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
