/// @file
// The parts of samples of Ruedo's client for C++.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <vector>

namespace ruedo::client {

/// A span of time: any of std::chrono's, or a number of seconds. kForever has no end.
class Duration : public std::chrono::duration<double> {
 public:
  /// @param seconds may be kForever
  constexpr Duration(double seconds)
      : std::chrono::duration<double>(seconds) {}  // NOLINT: both convert on purpose
  /// @param time of std::chrono
  template <class Rep, class Period>
  constexpr Duration(std::chrono::duration<Rep, Period> time)
      : std::chrono::duration<double>(time) {}  // NOLINT
};

inline constexpr double kForever = std::numeric_limits<double>::infinity();  ///< s
inline constexpr double kFast =
    std::numeric_limits<double>::infinity();  ///< a rate: as fast as it goes

using Vector3 = std::array<double, 3>;     ///< x, y, z
using Quaternion = std::array<double, 4>;  ///< w, x, y, z

/// @param angle rad
/// @return the equal one in [-pi, pi)
[[nodiscard]] double normalize_angle(double angle);

/// The pose of a frame B in a frame A: takes points of B to A. Products compose: if a is B in A and
/// b is C in B, a * b is C in A.
struct Transform {
  Vector3 position{};                          ///< m
  Quaternion orientation{1.0, 0.0, 0.0, 0.0};  ///< a unit quaternion w, x, y, z

  /// @param x m
  /// @param y m
  /// @param heading rad, counter-clockwise from the x axis
  /// @param z m
  /// @return a pose on the ground
  static Transform of(double x, double y, double heading = 0.0, double z = 0.0);
  double x() const { return position[0]; }  ///< @return m
  double y() const { return position[1]; }  ///< @return m
  double z() const { return position[2]; }  ///< @return m
  /// @return rad, counter-clockwise from A's x axis, in (-pi, pi]
  [[nodiscard]] double heading() const;
  [[nodiscard]] Transform inverse() const;  ///< @return A in B
  /// @param other C in B
  /// @return C in A
  [[nodiscard]] Transform operator*(const Transform& other) const;
  /// @param point of B, m
  /// @return it in A, m
  [[nodiscard]] Vector3 apply(const Vector3& point) const;
};

/// The members of all samples.
struct Sample {
  int64_t utime = 0;  ///< us, sim time of the state shown
  /// @return the same in s
  double time() const { return static_cast<double>(utime) * 1e-6; }
};

/// A message of any type, as it came.
struct RawSample : Sample {    // utime: where the type's first field is one; else 0
  std::vector<uint8_t> bytes;  ///< LCM's encoding, its fingerprint first
};

}  // namespace ruedo::client
