// Faults of sensors: what a device publishes is changed between it and the world.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "ruedo/sensor.h"

namespace ruedo::engine {

// Of one device, from a step on.
struct SensorFault {
  enum class Kind { dropout, freeze, lag, bias, scale, blocked, clock_drift };
  int64_t id = 0;  // counts them: states of faults are kept by it
  Kind kind = Kind::dropout;
  RobotIndex robot;
  std::string device;
  int64_t begin = 0, end = INT64_MAX;  // samples of begin <= step < end
  int64_t lag_steps = 0;
  double value = 0.0, from = 0.0, to = 1.0;

  bool acts_on(int of_robot, const std::string& of_device, int64_t step) const {
    return robot == of_robot && step >= begin && step < end && device == of_device;
  }
};

// Whether a device of that kind can be faulty so: a camera has no number to add a bias to.
bool applies_to(SensorFault::Kind fault, const std::string& device_kind);

// The faults of one device as they go on. Belongs to its module.
class FaultFilter {
 public:
  explicit FaultFilter(int64_t step_us) : step_us_(step_us) {}

  // What becomes of what the device published at a step. Faults act in their order.
  void pass(const Outbox& published, const std::vector<SensorFault>& faults, RobotIndex robot,
            const std::string& device, int64_t step, Outbox& out);

 private:
  struct Message {
    int channel;
    std::vector<uint8_t> bytes;
  };
  void freeze(const SensorFault& fault, std::vector<Message>& messages);
  void lag(const SensorFault& fault, int64_t step, std::vector<Message>& messages);

  int64_t step_us_;
  std::map<std::pair<int64_t, int>, std::vector<uint8_t>> frozen_;  // by fault and channel
  std::map<int64_t, std::deque<std::pair<int64_t, Message>>>
      under_way_;  // by fault: step and message
};

}  // namespace ruedo::engine
