// diagnostic_msgs/msg/DiagnosticArray: how a run gets on, once a second of real time.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

namespace ruedo::ros2 {

// Counts of other parts, since the run began.
struct HealthCounts {
  uint64_t lost_on_bus = 0;  // messages that the bus could not send, or not in time
  uint64_t missed = 0;       // that this node was too slow for
  uint64_t sent = 0;         // to ROS
  uint64_t dropped = 0;      // that DDS did not take
  uint64_t received = 0;     // commands from ROS
  uint64_t faulty = 0;       // that did not decode, were too large or too many
};

class Diagnostics {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr const char* kType = "diagnostic_msgs/msg/DiagnosticArray";

  explicit Diagnostics(Clock::time_point begin = Clock::now()) : last_(begin) {}

  void step(int64_t time_us) {
    time_us_ = time_us;
    ++steps_;
  }
  // The message, where it is due; CDR.
  std::optional<std::vector<uint8_t>> look(Clock::time_point now, const HealthCounts& counts);

 private:
  int64_t time_us_ = 0;
  uint64_t steps_ = 0;
  Clock::time_point last_;  // of what follows
  int64_t last_time_us_ = 0;
  uint64_t last_steps_ = 0;
  HealthCounts last_counts_;
};

}  // namespace ruedo::ros2
