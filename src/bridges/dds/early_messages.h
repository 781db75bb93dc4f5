// Datagrams that came before their writer was known, or right after, to be heard once it is.
//
// Cyclone DDS passes over what an unknown writer says. A client of Fast DDS sends its first request
// right behind the word that it has a writer: where the two change places on their way, the request
// would be lost, for Cyclone takes the writer's next heartbeat for the beginning of all that
// concerns it. So it is where Cyclone cannot take the word yet, since an earlier one is missing,
// which it gets a second later: a client that was there before the run finds the service at once.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <dds/ddsi/ddsi_locator.h>

#include "bridges/dds/rtps_message.h"

namespace ruedo::dds {

class EarlyMessages {
 public:
  using Clock = std::chrono::steady_clock;
  using Entity = std::array<uint8_t, 4>;
  struct Message {
    Prefix participant;
    Entity writer;
    ddsi_locator_t from;
    std::vector<uint8_t> bytes;
  };

  static constexpr size_t kMost = 256, kMostBytes = 1 << 20;
  static constexpr auto kLongest = std::chrono::seconds(4);
  // Once Cyclone knows the writer, it matches it with readers at once, where it has a processor.
  // Cyclone drops the duplicate.
  static constexpr std::array kDelays{std::chrono::milliseconds(5), std::chrono::milliseconds(100)};

  // Drops the newest in favour of the oldest: these end by themselves.
  void keep(Message message, Clock::time_point now);
  // To be called with each datagram: is_known says whether Cyclone knows a writer.
  void look(const std::function<bool(const Message&)>& is_known, Clock::time_point now);
  // Takes the heartbeats of known writers that have messages here out of a message: the first that
  // Cyclone hears of a writer is to be what it said first. Heartbeats come again.
  void keep_order(std::span<uint8_t> message) const;
  // One whose turn has come; those of a writer in their order.
  std::optional<Message> due(Clock::time_point now);

 private:
  struct Held {
    Message message;
    Clock::time_point came;
    std::optional<Clock::time_point> told = std::nullopt;
    size_t heard = 0;  // how often
  };
  std::deque<Held> held_;
  size_t bytes_ = 0;
};

// The first submessage of a user's writer: data or a heartbeat. None if there is
// none.
std::optional<std::pair<Prefix, EarlyMessages::Entity>> writer_in(std::span<uint8_t> message);

}  // namespace ruedo::dds
