// Quadrature over the intervals in which profiles and steering are smooth.
#include "robot/base_motion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "ruedo/math.h"

namespace ruedo::robot {

namespace {

// Gauss-Legendre of order 8 on [-1, 1] (Abramowitz and Stegun, table 25.4).
constexpr std::array<double, 4> kNodes = {0.1834346424956498, 0.5255324099163290,
                                          0.7966664774136267, 0.9602898564975363};
constexpr std::array<double, 4> kWeights = {0.3626837833783620, 0.3137066458778873,
                                            0.2223810344533745, 0.1012285362903763};
constexpr double kLargestPanel_rad = 1.0;
constexpr double kLongestSteering_s = 0.05;  // longest interval while the steering moves

template <class Add>
void quadrature(double begin, double end, Add add) {
  const double middle = 0.5 * (begin + end), half = 0.5 * (end - begin);
  for (size_t i = 0; i < kNodes.size(); ++i) {
    add(middle - kNodes[i] * half, kWeights[i] * half);
    add(middle + kNodes[i] * half, kWeights[i] * half);
  }
}

// v0 + a t, u0 + c t and w0 + b t over `duration`, from heading 0.
Displacement over_piece(const Profile::Segment& v, const Profile::Segment& u,
                        const Profile::Segment& w, double t, double duration) {
  const double v0 = v.velocity + v.acceleration * (t - v.time),
               u0 = u.velocity + u.acceleration * (t - u.time),
               w0 = w.velocity + w.acceleration * (t - w.time);
  const double way = (v0 + 0.5 * v.acceleration * duration) * duration,
               side = (u0 + 0.5 * u.acceleration * duration) * duration;
  const double angle = (w0 + 0.5 * w.acceleration * duration) * duration;
  if (v.acceleration == 0.0 && u.acceleration == 0.0 && w.acceleration == 0.0)
    return along_twist(way, side, angle);
  Displacement result;
  result.way = way;
  result.side = side;
  result.angle = angle;
  const double largest_angle = (std::abs(w0) + std::abs(w.acceleration) * duration) * duration;
  const int panels = 1 + static_cast<int>(std::min(largest_angle / kLargestPanel_rad, 1e6));
  for (int panel = 0; panel < panels; ++panel) {
    quadrature(duration * panel / panels, duration * (panel + 1) / panels,
               [&](double s, double weight) {
                 const double heading = (w0 + 0.5 * w.acceleration * s) * s,
                              cosine = math::cos(heading), sine = math::sin(heading);
                 const double ahead = v0 + v.acceleration * s, left = u0 + u.acceleration * s;
                 result.x += weight * (ahead * cosine - left * sine);
                 result.y += weight * (ahead * sine + left * cosine);
               });
  }
  return result;
}

}  // namespace

Displacement along_twist(double way, double side, double angle) {
  const double half = 0.5 * angle, part = half == 0.0 ? 1.0 : math::sin(half) / half;
  const double c = part * math::cos(half), s = part * math::sin(half);
  return {way * c - side * s, way * s + side * c, angle, way, side};
}

Displacement integrate(const Profile& v, const Profile& side, const Profile& omega, double begin,
                       double end) {
  Displacement sum;
  for (double t = begin; t < end;) {
    const double next =
        std::min({end, v.next_change(t), side.next_change(t), omega.next_change(t)});
    sum = chained(sum, over_piece(v.at(t), side.at(t), omega.at(t), t, next - t));
    t = next;
  }
  return sum;
}

SteeringPlan SteeringPlan::between(double from, double to, double rate) {
  return {from, to, std::isinf(rate) ? 0.0 : std::abs(to - from) / rate};
}

double SteeringPlan::angle(double time) const {
  return time >= end ? to : from + (to - from) * (time / end);
}

Displacement integrate_steered(const Profile& v, const SteeringPlan& steering, double wheelbase,
                               double begin, double end) {
  Displacement sum;
  for (double t = begin; t < end;) {
    double next = std::min(end, v.next_change(t));
    const Profile::Segment& segment = v.at(t);
    const auto speed = [&](double time) {
      return segment.velocity + segment.acceleration * (time - segment.time);
    };
    if (t >= steering.end) {
      const double way = 0.5 * (speed(t) + speed(next)) * (next - t);
      sum = chained(sum, along_arc(way, way * math::tan(steering.to) / wheelbase));
    } else {
      next = std::min({next, steering.end, t + kLongestSteering_s});
      const auto heading = [&](double to) {
        double angle = 0.0;
        quadrature(t, to, [&](double s, double weight) {
          angle += weight * speed(s) * math::tan(steering.angle(s)) / wheelbase;
        });
        return angle;
      };
      Displacement piece;
      quadrature(t, next, [&](double s, double weight) {
        const double at = heading(s);
        piece.x += weight * speed(s) * math::cos(at);
        piece.y += weight * speed(s) * math::sin(at);
      });
      piece.way = 0.5 * (speed(t) + speed(next)) * (next - t);
      piece.angle = heading(next);
      sum = chained(sum, piece);
    }
    t = next;
  }
  return sum;
}

}  // namespace ruedo::robot
