// Sensor faults: change what a device publishes on its way out.
#pragma once

#include <cstddef>
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
  // Bytes of the messages that the faults of a world keep at a time, those that lag and those that
  // are frozen, in equal shares: what a device keeps depends on no other thread.
  static constexpr size_t kMostKept = 512u << 20;

  explicit FaultFilter(int64_t step_us, size_t most_kept = kMostKept)
      : step_us_(step_us), most_kept_(most_kept) {}

  // Applies the faults, in order, to what the device published at a step.
  void pass(const Outbox& published, const std::vector<SensorFault>& faults, RobotIndex robot,
            const std::string& device, int64_t step, Outbox& out);

  size_t kept() const;  // bytes

 private:
  struct Message {
    int channel;
    std::vector<uint8_t> bytes;
  };
  struct Kept {
    std::map<int, std::vector<uint8_t>> frozen;         // by channel
    std::deque<std::pair<int64_t, Message>> under_way;  // with their steps
    size_t bytes = 0;
    bool told = false;  // that there is no room for more
  };
  static size_t cost(const Message& message);
  void freeze(const SensorFault& fault, Kept& kept, size_t room, std::vector<Message>& messages);
  void lag(const SensorFault& fault, int64_t step, Kept& kept, size_t room,
           std::vector<Message>& messages);

  int64_t step_us_;
  size_t most_kept_;
  std::map<int64_t, Kept> kept_;  // by fault
};

}  // namespace ruedo::engine
