// Sensor faults: change what a device publishes on its way out.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "ruedo/sensor.h"

namespace ruedo::engine {

// For one device, from a step on.
struct SensorFault {
  enum class Kind { dropout, freeze, lag, bias, scale, blocked, clock_drift };
  int64_t id = 0;  // identifies the fault's state
  Kind kind = Kind::dropout;
  RobotIndex robot;
  std::string device;
  int64_t begin = 0, end = INT64_MAX;  // affects samples with begin <= step < end
  int64_t lag_steps = 0;
  double value = 0.0, from = 0.0, to = 1.0;

  bool acts_on(int of_robot, const std::string& of_device, int64_t step) const {
    return robot == of_robot && step >= begin && step < end && device == of_device;
  }
};

// Whether a kind of device can have that fault: a camera has no number to add a bias to.
bool applies_to(SensorFault::Kind fault, const std::string& device_kind);

// The current faults of one device. Owned by its module.
class FaultFilter {
 public:
  explicit FaultFilter(int64_t step_us) : step_us_(step_us) {}

  // Applies the faults, in order, to what the device published at a step.
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
