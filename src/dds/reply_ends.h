// Whether it is known who reads a client's replies, which would be lost before: ends of a client
// are discovered one after another. rmw_cyclonedds waits for that, too.
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

  // A client that hears nothing is waited for so long, and no more from then on.
  static constexpr auto kLongest = std::chrono::milliseconds(500);

  // Of a reader of requests and the writer of their replies.
  ReplyEnds(dds_entity_t requests, dds_entity_t replies) : requests_(requests), replies_(replies) {}

  // Whether a request of that writer may be answered now.
  bool may_answer(dds_instance_handle_t writer, Clock::time_point now);

 private:
  using Participant = std::array<uint8_t, 16>;

  bool hears(dds_instance_handle_t writer);
  bool look(dds_instance_handle_t writer);
  void give_up(dds_instance_handle_t writer);
  // How many more writers of requests than readers of replies the writer's participant has.
  size_t missing(const Participant& whose) const;

  dds_entity_t requests_, replies_;
  std::map<dds_instance_handle_t, bool> hears_;  // what was found, as long as no end comes
  std::map<dds_instance_handle_t, Clock::time_point> until_;  // those that are waited for
  uint32_t ends_ = 0;                                         // that have come since the beginning
  std::map<Participant, size_t> deaf_;                        // how many were waited for in vain
};

}  // namespace ruedo::dds
