// Speed, direction and vertical speed of the wind over time.
#include "robot/wind.h"

#include "ruedo/math.h"

namespace ruedo::robot {
namespace {

double risen(double t_s, double rise_s) {
  return rise_s > 0.0 ? 1.0 - math::exp(-t_s / rise_s) : 1.0;
}

double wave(double t_s, double period_s) { return math::sin(2 * M_PI * t_s / period_s); }

double drawn(const world::Wind::Noise& noise, RandomStream& stream) {
  return noise.mean + noise.stddev * stream.gaussian();
}

}  // namespace

Wind::Wind(const world::Wind& description, uint64_t seed)
    : wind_(description),
      speed_(description.velocity.head<2>().norm()),
      direction_(math::atan2(description.velocity.y(), description.velocity.x())),
      random_(seed, "ruedo", "wind") {}

Vec3 Wind::at(int64_t step, SimTime step_us) const {
  if (!wind_.pushes) return wind_.velocity;
  const double t = static_cast<double>(step * step_us) * 1e-6;
  RandomStream stream = random_.stream(static_cast<uint64_t>(step));
  const double mean = speed_ * risen(t, wind_.rise_s);
  const double speed =
      mean + wind_.swing * mean * wave(t, wind_.swing_period_s) + drawn(wind_.speed_noise, stream);
  const double direction =
      direction_ + wind_.turn_rad * wave(t, wind_.turn_period_s) + drawn(wind_.turn_noise, stream);
  const double vertical =
      wind_.velocity.z() * risen(t, wind_.vertical_rise_s) + drawn(wind_.vertical_noise, stream);
  return {speed * math::cos(direction), speed * math::sin(direction), vertical};
}

}  // namespace ruedo::robot
