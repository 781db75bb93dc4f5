// The integrals of the unicycle.
#include "robot/unicycle.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/math/sincos.h"
#include "base/whole.h"

namespace ruedo::robot {

namespace {

// Gauss-Legendre of order 8 on [-1, 1] (Abramowitz and Stegun, table 25.4): over an angle of 1 rad
// the error is below 1e-18 of the distance.
constexpr std::array<double, 4> kNodes = {0.1834346424956498, 0.5255324099163290,
                                          0.7966664774136267, 0.9602898564975363};
constexpr std::array<double, 4> kWeights = {0.3626837833783620, 0.3137066458778873,
                                            0.2223810344533745, 0.1012285362903763};
constexpr double kLargestPanel_rad = 1.0;

// v0 + a t and w0 + b t over `duration`, from heading 0.
Displacement over_piece(double v0, double a, double w0, double b, double duration) {
  const double way = (v0 + 0.5 * a * duration) * duration;
  const double angle = (w0 + 0.5 * b * duration) * duration;
  // Constant curvature: v and omega in constant proportion, or one of them zero.
  if (std::abs(v0 * b - w0 * a) <= 1e-15 * (std::abs(v0 * b) + std::abs(w0 * a)))
    return along_arc(way, angle);

  Displacement result;
  result.way = way;
  result.angle = angle;
  const double largest_angle = (std::abs(w0) + std::abs(b) * duration) * duration;
  const int panels = 1 + whole<int>(std::min(largest_angle / kLargestPanel_rad, 1e6));
  const double half = 0.5 * duration / panels;
  const auto add = [&](double t, double weight) {
    const double heading = (w0 + 0.5 * b * t) * t, speed = (v0 + a * t) * weight;
    const auto [sine, cosine] = math::sincos(heading);
    result.x += speed * cosine;
    result.y += speed * sine;
  };
  for (int panel = 0; panel < panels; ++panel) {
    const double middle = (2 * panel + 1) * half;
    for (size_t i = 0; i < kNodes.size(); ++i) {
      add(middle - kNodes[i] * half, kWeights[i] * half);
      add(middle + kNodes[i] * half, kWeights[i] * half);
    }
  }
  return result;
}

}  // namespace

Displacement along_arc(double way, double angle) {
  Displacement result;
  result.way = way;
  result.angle = angle;
  const double half = 0.5 * angle;
  if (half == 0.0) {  // also half of the smallest number above 0
    result.x = way;
    return result;
  }
  const auto [sine, cosine] = math::sincos(half);
  const double chord =
      way * (sine / half);  // sin(h) / h is well conditioned down to the smallest angles
  result.x = chord * cosine;
  result.y = chord * sine;
  return result;
}

Displacement chained(const Displacement& first, const Displacement& second) {
  const auto [s, c] = math::sincos(first.angle);
  return {first.x + c * second.x - s * second.y, first.y + s * second.x + c * second.y,
          first.angle + second.angle, first.way + second.way, first.side + second.side};
}

Displacement integrate(const Profile& v, const Profile& omega, double begin, double end) {
  Displacement sum;
  bool first = true;
  for (double t = begin; t < end;) {
    const double next = std::min({end, v.next_change(t), omega.next_change(t)});
    const Profile::Segment& of_v = v.at(t);
    const Profile::Segment& of_omega = omega.at(t);
    const Displacement piece =
        over_piece(of_v.velocity + of_v.acceleration * (t - of_v.time), of_v.acceleration,
                   of_omega.velocity + of_omega.acceleration * (t - of_omega.time),
                   of_omega.acceleration, next - t);
    sum = first ? piece : chained(sum, piece);
    first = false;
    t = next;
  }
  return sum;
}

}  // namespace ruedo::robot
