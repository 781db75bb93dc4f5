// Planning of velocity profiles: v^2 = 2 a s, solved for the peak or cruise speed.
#include "robot/profile.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace ruedo::robot {

// While a profile is being planned, its last segment marks the end of the plan up to now.
void Profile::add(double duration, double velocity, double acceleration) {
  if (!(duration > 0.0)) return;
  assert(count_ < kCapacity);
  Segment& now = segments_[count_ - 1];
  now.velocity = velocity;
  now.acceleration = acceleration;
  Segment next;
  next.time = now.time + duration;
  next.position = now.position + (velocity + 0.5 * acceleration * duration) * duration;
  segments_[count_++] = next;
}

void Profile::keep(double velocity) {
  segments_[count_ - 1].velocity = velocity;
  segments_[count_ - 1].acceleration = 0.0;
}

void Profile::keep_at(double velocity, double position) {
  keep(velocity);
  segments_[count_ - 1].position = position;
}

Profile Profile::to_velocity(double velocity, double target, const Limits& limits) {
  Profile profile;
  if (velocity * target < 0.0) {  // first brake to rest
    profile.add(std::abs(velocity) / limits.deceleration, velocity,
                std::copysign(limits.deceleration, -velocity));
    velocity = 0.0;
  }
  const double rate =
      std::abs(target) > std::abs(velocity) ? limits.acceleration : limits.deceleration;
  if (target != velocity) {
    profile.add(std::abs(target - velocity) / rate, velocity,
                std::copysign(rate, target - velocity));
  }
  profile.keep(target);
  return profile;
}

Profile Profile::to_distance(double velocity, double distance, const Limits& limits) {
  Profile profile;
  const double a = limits.acceleration, d = limits.deceleration;
  double rest = distance, v = velocity;
  const double braking_way = v * std::abs(v) / (2.0 * d);
  // Going the wrong way, or too fast to stop in time: brake to rest, and continue from there.
  if (v != 0.0 && (v * distance <= 0.0 || std::abs(braking_way) > std::abs(distance))) {
    profile.add(std::abs(v) / d, v, std::copysign(d, -v));
    rest -= braking_way;
    v = 0.0;
  }
  const double sign = rest < 0.0 ? -1.0 : 1.0;
  rest = std::abs(rest);
  v = std::abs(v);
  double way_to_stop = v * v / (2.0 * d);
  if (v > limits.speed) {  // brake to the allowed speed
    profile.add((v - limits.speed) / d, sign * v, -sign * d);
    rest -= way_to_stop - limits.speed * limits.speed / (2.0 * d);
    v = limits.speed;
    way_to_stop = v * v / (2.0 * d);
  }
  // Peak of the triangle: (peak^2 - v^2) / 2a + peak^2 / 2d = rest.
  const double reciprocals = 1.0 / a + 1.0 / d;
  double peak =
      reciprocals > 0.0 ? std::sqrt((2.0 * rest + v * v / a) / reciprocals) : limits.speed;
  double cruise_way = 0.0;
  if (peak >= limits.speed) {
    peak = limits.speed;
    cruise_way = rest - (peak * peak - v * v) / (2.0 * a) - peak * peak / (2.0 * d);
  }
  if (rest > 0.0) {
    profile.add((peak - v) / a, sign * v, sign * a);
    profile.add(std::max(cruise_way, 0.0) / peak, sign * peak, 0.0);
    profile.add(peak / d, sign * peak, -sign * d);
  }
  profile.keep_at(0.0, distance);
  return profile;
}

void Profile::append(const Profile& other, double at) {
  Segment& last = segments_[count_ - 1];
  const double position = last.position + last.velocity * (at - last.time);
  if (at <= last.time) --count_;
  for (int i = 0; i < other.count_; ++i) {
    assert(count_ < kCapacity);
    Segment segment = other.segments_[i];
    segment.time += at;
    segment.position += position;
    segments_[count_++] = segment;
  }
}

Profile Profile::scaled(double factor) const {
  Profile result = *this;
  for (Segment& segment : result.segments_) {
    segment.position *= factor;
    segment.velocity *= factor;
    segment.acceleration *= factor;
  }
  return result;
}

const Profile::Segment& Profile::at(double time) const {
  int i = count_ - 1;
  while (i > 0 && time < segments_[i].time) --i;
  return segments_[i];
}

double Profile::next_change(double time) const {
  for (int i = 1; i < count_; ++i) {
    if (segments_[i].time > time) return segments_[i].time;
  }
  return std::numeric_limits<double>::infinity();
}

double Profile::velocity(double time) const {
  const Segment& segment = at(time);
  return segment.velocity + segment.acceleration * (time - segment.time);
}

double Profile::position(double time) const {
  const Segment& segment = at(time);
  const double t = time - segment.time;
  return segment.position + (segment.velocity + 0.5 * segment.acceleration * t) * t;
}

}  // namespace ruedo::robot
