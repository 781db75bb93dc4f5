// Requests that are here before it is known who reads their replies, which would be lost: ends of a
// client are discovered one after another. rmw_cyclonedds waits for that, too.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>

#include <dds/dds.h>

namespace ruedo::dds {

class EarlyRequests {
 public:
  using Clock = std::chrono::steady_clock;

  // A client that hears nothing is waited for so long, and no more from then on.
  static constexpr auto kLongest = std::chrono::milliseconds(500);
  static constexpr size_t kMost = 64, kMostOfOne = 8;

  // Of a reader of requests and the writer of their replies.
  EarlyRequests(dds_entity_t requests, dds_entity_t replies)
      : requests_(requests), replies_(replies) {}
  ~EarlyRequests();
  EarlyRequests(const EarlyRequests&) = delete;
  EarlyRequests& operator=(const EarlyRequests&) = delete;

  // Whether the request is kept, with a reference of its own; false: it is to be answered now.
  bool keep(ddsi_serdata* request, dds_instance_handle_t writer, Clock::time_point now);

  // A request that may be answered by now, whose reference goes to the caller; null: there is none.
  struct Ready {
    ddsi_serdata* request = nullptr;
    dds_instance_handle_t writer = 0;
  };
  Ready next(Clock::time_point now);
  bool empty() const { return kept_.empty(); }

 private:
  using Participant = std::array<uint8_t, 16>;
  struct Kept {
    Ready what;
    Clock::time_point until;
  };

  bool hears(dds_instance_handle_t writer);
  bool look(dds_instance_handle_t writer);
  void give_up(dds_instance_handle_t writer);
  // How many more writers of requests than readers of replies the writer's participant has.
  size_t missing(const Participant& whose) const;

  dds_entity_t requests_, replies_;
  std::deque<Kept> kept_;
  std::map<dds_instance_handle_t, bool> hears_;  // what was found, as long as no end comes
  uint32_t ends_ = 0;                            // that have come since the beginning
  std::map<Participant, size_t> deaf_;           // how many were waited for in vain
};

}  // namespace ruedo::dds
