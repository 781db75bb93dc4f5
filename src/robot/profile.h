// Velocity profiles: piecewise linear velocities over time, planned in closed form and evaluated
// exactly.
//
// Nothing here depends on a step size. Units are m and s for translation, rad and s for rotation;
// time counts from the start of the profile.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

namespace ruedo::robot {

// Limits of one axis of motion; all >= 0, infinite: none.
struct Limits {
  double speed = std::numeric_limits<double>::infinity();
  double acceleration = std::numeric_limits<double>::infinity();
  double deceleration = std::numeric_limits<double>::infinity();
};

class Profile {
 public:
  struct Segment {
    double time = 0.0, position = 0.0, velocity = 0.0;  // at its start
    double acceleration = 0.0;
  };

  Profile() = default;  // at rest for ever
  // Reaches the velocity `target` from `velocity` as fast as the limits allow, and keeps it.
  static Profile to_velocity(double velocity, double target, const Limits& limits);
  // Comes to rest at `distance` from here, as fast as the limits allow: trapezoid or triangle,
  // after braking or turning round where the velocity asks for it. Needs speed > 0; unlimited
  // acceleration is allowed.
  static Profile to_distance(double velocity, double distance, const Limits& limits);

  // Appends other: it begins `at` seconds from here, no earlier than this one has come to its last
  // segment. It must begin with the velocity that this one keeps.
  void append(const Profile& other, double at);
  // This profile with velocities and positions times `factor`.
  Profile scaled(double factor) const;

  double velocity(double time) const;
  double position(double time) const;
  // The segment that holds at `time`; at a boundary the later one.
  const Segment& at(double time) const;
  // Begin of the next segment after `time`; infinity in the last one.
  double next_change(double time) const;
  // Time from which on the velocity does not change any more.
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
