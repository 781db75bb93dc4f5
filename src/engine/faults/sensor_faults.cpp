// Messages are changed as bytes if possible; otherwise decoded, changed and encoded again.
#include "engine/faults/sensor_faults.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#include <spdlog/spdlog.h>

#include "base/big_endian.h"
#include "base/whole.h"
#include "ruedo/decode.h"
#include "ruedo/imu_t.hpp"
#include "ruedo/lidar_t.hpp"
#include "ruedo/odometry_t.hpp"
#include "ruedo/odometry_twist_t.hpp"
#include "ruedo/planar_lidar_t.hpp"
#include "ruedo/sonar_t.hpp"

namespace ruedo::engine {
namespace {

constexpr double kFarthest = 1e30;    // of what is measured, by many faults at once
constexpr size_t kBesideBytes = 128;  // of memory, for a message that is kept
constexpr size_t kTimeAt = 8;         // every type begins with its fingerprint and int64_t utime

// A plugin's message may have no time.
bool has_time(const std::vector<uint8_t>& bytes) {
  return bytes.size() >= kTimeAt + sizeof(int64_t);
}

int64_t time_of(const std::vector<uint8_t>& bytes) {
  if (!has_time(bytes)) return 0;
  return read_big_endian<int64_t>(&bytes[kTimeAt]);
}

void set_time(std::vector<uint8_t>& bytes, int64_t time) {
  if (has_time(bytes)) write_big_endian(&bytes[kTimeAt], time);
}

// As expected by Outbox.
struct Encoded {
  const std::vector<uint8_t>& bytes;
  int getEncodedSize() const { return static_cast<int>(bytes.size()); }
  int encode(void* to, int offset, int size) const {
    std::memcpy(static_cast<uint8_t*>(to) + offset, bytes.data(), static_cast<size_t>(size));
    return size;
  }
};

// Missing returns, and those below the minimum, are unchanged.
template <class Number>
Number wrong(const SensorFault& fault, Number value) {
  if (!std::isfinite(value)) return value;
  const double changed =
      fault.kind == SensorFault::Kind::bias ? value + fault.value : value * fault.value;
  return static_cast<Number>(std::clamp(changed, -kFarthest, kFarthest));
}

template <class Number>
void change_rays(const SensorFault& fault, std::vector<Number>& ranges, size_t row) {
  if (row == 0) return;
  const auto count = static_cast<double>(row);
  const size_t first = rounded_up<size_t>(fault.from * count),
               last = rounded_down<size_t>(fault.to * count);
  for (size_t i = 0; i < ranges.size(); ++i) {
    if (fault.kind != SensorFault::Kind::blocked) {
      ranges[i] = std::max(wrong(fault, ranges[i]), Number{0});
    } else if (i % row >= first && i % row < last) {
      ranges[i] = static_cast<Number>(fault.value);
    }
  }
}

void change(const SensorFault& fault, planar_lidar_t& message) {
  change_rays(fault, message.ranges, message.ranges.size());
}
void change(const SensorFault& fault, sonar_t& message) {
  change_rays(fault, message.range, message.range.size());
}
void change(const SensorFault& fault, lidar_t& message) {
  change_rays(fault, message.ranges, static_cast<size_t>(std::max(message.ncolumns, 0)));
}
void change(const SensorFault& fault, odometry_t& message) {  // a bias applies to its heading
  message.theta = wrong(fault, message.theta);
  if (fault.kind == SensorFault::Kind::bias) return;
  for (double* value : {&message.x, &message.y, &message.v, &message.omega})
    *value = wrong(fault, *value);
}
void change(const SensorFault& fault, odometry_twist_t& message) {
  if (fault.kind == SensorFault::Kind::bias) return;
  for (double* value : {&message.vx, &message.vy, &message.omega}) *value = wrong(fault, *value);
}
// a bias applies to the rate about its z axis
void change(const SensorFault& fault, imu_t& message) {
  message.angular_velocity[2] = wrong(fault, message.angular_velocity[2]);
  if (fault.kind == SensorFault::Kind::bias) return;
  for (double* value : {&message.angular_velocity[0], &message.angular_velocity[1]})
    *value = wrong(fault, *value);
  for (double& value : message.linear_acceleration) value = wrong(fault, value);
}

template <class Type>
bool change_as(const SensorFault& fault, std::vector<uint8_t>& bytes) {
  Type message;
  if (fingerprint_of(bytes) != Type::getHash() ||
      decode_checked(bytes.data(), bytes.size(), message) != DecodeFault::none)
    return false;
  change(fault, message);
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return true;
}

void change_values(const SensorFault& fault, std::vector<uint8_t>& bytes) {
  static_cast<void>(change_as<planar_lidar_t>(fault, bytes) || change_as<sonar_t>(fault, bytes) ||
                    change_as<lidar_t>(fault, bytes) || change_as<odometry_t>(fault, bytes) ||
                    change_as<odometry_twist_t>(fault, bytes) || change_as<imu_t>(fault, bytes));
}

bool keeps(const SensorFault& fault) {
  return fault.kind == SensorFault::Kind::freeze || fault.kind == SensorFault::Kind::lag;
}

size_t keepers(const std::vector<SensorFault>& faults, int64_t step) {
  return static_cast<size_t>(
      std::count_if(faults.begin(), faults.end(), [=](const SensorFault& fault) {
        return keeps(fault) && step >= fault.begin && step < fault.end;
      }));
}

void tell_lost(const SensorFault& fault, bool& told) {
  if (!std::exchange(told, true))
    spdlog::warn("{}: messages are lost, since a fault keeps more than there is room for",
                 fault.device);
}

}  // namespace

bool applies_to(SensorFault::Kind fault, const std::string& device_kind) {
  const bool rays = device_kind == "lrf" || device_kind == "lidar" || device_kind == "sonar";
  if (fault == SensorFault::Kind::blocked) return rays;
  if (fault == SensorFault::Kind::bias || fault == SensorFault::Kind::scale)
    return rays || device_kind == "odometry" || device_kind == "imu";
  return true;
}

size_t FaultFilter::cost(const Message& message) { return message.bytes.size() + kBesideBytes; }

size_t FaultFilter::kept() const {
  size_t bytes = 0;
  for (const auto& [fault, kept] : kept_) bytes += kept.bytes;
  return bytes;
}

void FaultFilter::pass(const Outbox& published, const std::vector<SensorFault>& faults,
                       RobotIndex robot, const std::string& device, int64_t step, Outbox& out) {
  std::vector<Message> messages;
  for (const Outbox::Entry& entry : published.entries()) {
    const uint8_t* bytes = published.data(entry);
    messages.push_back({entry.channel, {bytes, bytes + entry.size}});
  }
  const size_t room = most_kept_ / std::max<size_t>(1, keepers(faults, step));
  std::map<int64_t, Kept> before;  // what is not taken from here is of faults that have ended
  before.swap(kept_);
  for (const SensorFault& fault : faults) {
    if (!fault.acts_on(robot, device, step)) continue;
    if (keeps(fault)) kept_[fault.id] = std::move(before[fault.id]);
    switch (fault.kind) {
      case SensorFault::Kind::dropout: messages.clear(); break;
      case SensorFault::Kind::freeze: freeze(fault, kept_[fault.id], room, messages); break;
      case SensorFault::Kind::lag: lag(fault, step, kept_[fault.id], room, messages); break;
      case SensorFault::Kind::clock_drift:
        for (Message& message : messages) {
          set_time(message.bytes,
                   time_of(message.bytes) +
                       rounded(fault.value * static_cast<double>((step - fault.begin) * step_us_)));
        }
        break;
      default:
        for (Message& message : messages) change_values(fault, message.bytes);
    }
  }
  for (const Message& message : messages) out.publish(message.channel, Encoded{message.bytes});
}

// The first message under the fault is repeated with current times: a hanging driver puts new
// stamps on old data.
void FaultFilter::freeze(const SensorFault& fault, Kept& kept, size_t room,
                         std::vector<Message>& messages) {
  if (kept.bytes > room) {
    kept.frozen.clear();
    kept.bytes = 0;
  }
  std::erase_if(messages, [&](Message& message) {
    auto first = kept.frozen.find(message.channel);
    if (first == kept.frozen.end()) {
      if (kept.bytes + cost(message) > room) return tell_lost(fault, kept.told), true;
      kept.bytes += cost(message);
      first = kept.frozen.emplace(message.channel, message.bytes).first;
    }
    const int64_t now = time_of(message.bytes);
    message.bytes = first->second;
    set_time(message.bytes, now);
    return false;
  });
}

// Old messages keep their time. Those still delayed when the fault ends are lost.
void FaultFilter::lag(const SensorFault& fault, int64_t step, Kept& kept, size_t room,
                      std::vector<Message>& messages) {
  for (Message& message : messages) {
    kept.bytes += cost(message);
    kept.under_way.emplace_back(step, std::move(message));
  }
  messages.clear();
  while (!kept.under_way.empty() && kept.under_way.front().first + fault.lag_steps <= step) {
    messages.push_back(std::move(kept.under_way.front().second));
    kept.under_way.pop_front();
    kept.bytes -= cost(messages.back());
  }
  for (; kept.bytes > room; tell_lost(fault, kept.told)) {
    kept.bytes -= cost(kept.under_way.back().second);
    kept.under_way.pop_back();
  }
}

}  // namespace ruedo::engine
