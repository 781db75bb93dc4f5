// Messages are changed as bytes if possible; otherwise decoded, changed and encoded again.
#include "engine/sensor_faults.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#include "core/big_endian.h"
#include "core/whole.h"
#include "ruedo/decode.h"
#include "ruedo/imu_t.hpp"
#include "ruedo/lidar_t.hpp"
#include "ruedo/odometry_t.hpp"
#include "ruedo/planar_lidar_t.hpp"
#include "ruedo/sonar_t.hpp"

namespace ruedo::engine {
namespace {

constexpr double kFarthest = 1e30;  // of what is measured, by many faults at once
constexpr size_t kTimeAt = 8;       // every type begins with its fingerprint and int64_t utime

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
// a bias applies to the rate about its z axis
void change(const SensorFault& fault, imu_t& message) {
  if (fault.kind == SensorFault::Kind::bias) {
    message.angular_velocity[2] += fault.value;
    return;
  }
  for (double& value : message.angular_velocity) value *= fault.value;
  for (double& value : message.linear_acceleration) value *= fault.value;
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
                    change_as<imu_t>(fault, bytes));
}

}  // namespace

bool applies_to(SensorFault::Kind fault, const std::string& device_kind) {
  const bool rays = device_kind == "lrf" || device_kind == "lidar" || device_kind == "sonar";
  if (fault == SensorFault::Kind::blocked) return rays;
  if (fault == SensorFault::Kind::bias || fault == SensorFault::Kind::scale)
    return rays || device_kind == "odometry" || device_kind == "imu";
  return true;
}

void FaultFilter::pass(const Outbox& published, const std::vector<SensorFault>& faults,
                       RobotIndex robot, const std::string& device, int64_t step, Outbox& out) {
  std::vector<Message> messages;
  for (const Outbox::Entry& entry : published.entries()) {
    const uint8_t* bytes = published.data(entry);
    messages.push_back({entry.channel, {bytes, bytes + entry.size}});
  }
  for (const SensorFault& fault : faults) {
    if (!fault.acts_on(robot, device, step)) continue;
    switch (fault.kind) {
      case SensorFault::Kind::dropout: messages.clear(); break;
      case SensorFault::Kind::freeze: freeze(fault, messages); break;
      case SensorFault::Kind::lag: lag(fault, step, messages); break;
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
void FaultFilter::freeze(const SensorFault& fault, std::vector<Message>& messages) {
  for (Message& message : messages) {
    const auto [kept, first] = frozen_.try_emplace({fault.id, message.channel}, message.bytes);
    if (first) continue;
    const int64_t now = time_of(message.bytes);
    message.bytes = kept->second;
    set_time(message.bytes, now);
  }
}

// Old messages keep their time. Those still delayed when the fault ends are lost.
void FaultFilter::lag(const SensorFault& fault, int64_t step, std::vector<Message>& messages) {
  auto& under_way = under_way_[fault.id];
  for (Message& message : messages) under_way.emplace_back(step, std::move(message));
  messages.clear();
  while (!under_way.empty() && under_way.front().first + fault.lag_steps <= step) {
    messages.push_back(std::move(under_way.front().second));
    under_way.pop_front();
  }
}

}  // namespace ruedo::engine
