// Velocity profiles: piecewise linear velocities over time, planned in closed form and evaluated
// exactly.
//
// Independent of any step size. Units are m and s for translation, rad and s for rotation; time
// counts from the start of the profile.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

namespace ruedo::robot {

// Limits of one axis of motion; all >= 0, infinite: no limit.
struct Limits {
  double speed = std::numeric_limits<double>::infinity();
  double acceleration = std::numeric_limits<double>::infinity();
  double deceleration = std::numeric_limits<double>::infinity();
};

class Profile {
 public:
  struct Segment {
    double time = 0.0, position = 0.0, velocity = 0.0;  // at the start of the segment
    double acceleration = 0.0;
  };

  Profile() = default;  // at rest forever
  // Reaches the velocity `target` from `velocity` as fast as the limits allow, and keeps it.
  static Profile to_velocity(double velocity, double target, const Limits& limits);
  // Comes to rest at `distance` as fast as the limits allow: a trapezoid or triangle, after braking
  // or reversing if the velocity requires it. Needs speed > 0; infinite acceleration is allowed.
  static Profile to_distance(double velocity, double distance, const Limits& limits);

  // Appends `other`, starting `at` seconds from here, not before this profile's last segment. It
  // must start with the velocity that this one keeps.
  void append(const Profile& other, double at);
  // This profile with velocities and positions multiplied by `factor`.
  Profile scaled(double factor) const;

  double velocity(double time) const;
  double position(double time) const;
  // The segment at `time`; at a boundary the later one.
  const Segment& at(double time) const;
  // Start of the first segment after `time`; infinity in the last one.
  double next_change(double time) const;
  // The time after which the velocity is constant.
  double end() const { return segments_[count_ - 1].time; }
  double final_position() const { return segments_[count_ - 1].position; }

 private:
  void add(double duration, double velocity, double acceleration);
  void keep(double velocity);
  void keep_at(double velocity, double position);

  static constexpr int kCapacity = 10;
  std::array<Segment, kCapacity> segments_{};
  int count_ = 1;
};

}  // namespace ruedo::robot
