// Tracks whether a client's reply reader has been discovered; replies sent earlier would be lost,
// since the endpoints of a client are discovered one after another. rmw_cyclonedds waits for that,
// too.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>

#include <dds/dds.h>

namespace ruedo::dds {

class ReplyEnds {
 public:
  using Clock = std::chrono::steady_clock;

  // A client without a reply reader is waited for this long, and not again. Discovery takes
  // milliseconds, and seconds on a machine that does much else.
  static constexpr auto kLongest = std::chrono::seconds(5);

  // For a reader of requests and the writer of their replies.
  ReplyEnds(dds_entity_t requests, dds_entity_t replies) : requests_(requests), replies_(replies) {}

  // Whether a request of that writer may be answered now.
  bool may_answer(dds_instance_handle_t writer, Clock::time_point now);

 private:
  using Participant = std::array<uint8_t, 16>;

  bool hears(dds_instance_handle_t writer);
  bool look(dds_instance_handle_t writer);
  void give_up(dds_instance_handle_t writer);
  // How many more request writers than reply readers the writer's participant has.
  size_t missing(const Participant& whose) const;

  dds_entity_t requests_, replies_;
  std::map<dds_instance_handle_t, bool> hears_;               // cached until endpoints change
  std::map<dds_instance_handle_t, Clock::time_point> until_;  // those being waited for
  uint32_t ends_ = 0;                                         // number of discovered endpoints
  std::map<Participant, size_t> deaf_;                        // how many were waited for in vain
};

}  // namespace ruedo::dds
