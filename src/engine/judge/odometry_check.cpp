// The frame of odometry starts at the robot's pose, and again at each reset of the odometry.
#include "engine/judge/odometry_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "ruedo/math.h"

namespace ruedo::judge {

void OdometryCheck::see_truth(SimTime time, const Pose& X_WBase, int32_t resets) {
  if (parts_.empty() || time <= parts_.back().truth.back().time) parts_.emplace_back();
  Part& part = parts_.back();
  const Place place{time, X_WBase.translation.x(), X_WBase.translation.y(),
                    heading(X_WBase.rotation)};
  // A reset takes effect on the state before the one that shows it.
  part.origins.try_emplace(resets, part.truth.empty() ? place : part.truth.back());
  part.truth.push_back(place);
}

void OdometryCheck::see(const odometry_t& sample) {
  const size_t part = parts_.empty() ? 0 : parts_.size() - 1;
  samples_.push_back({sample.utime, sample.x, sample.y, sample.resets, part});
}

double OdometryCheck::error_of(const Sample& sample) const {
  constexpr double kNoTruth = std::numeric_limits<double>::infinity();
  if (sample.part >= parts_.size()) return kNoTruth;
  const Part& part = parts_[sample.part];
  const auto origin = part.origins.find(sample.resets);
  if (origin == part.origins.end()) return kNoTruth;
  const auto after =
      std::lower_bound(part.truth.begin(), part.truth.end(), sample.time,
                       [](const Place& place, SimTime time) { return place.time < time; });
  const Place& b = after == part.truth.end() ? part.truth.back() : *after;
  const Place& a = after == part.truth.begin() ? b : *(after - 1);
  const double between =
      b.time == a.time || after == part.truth.end()
          ? 1.0
          : static_cast<double>(sample.time - a.time) / static_cast<double>(b.time - a.time);
  const double dx = a.x + between * (b.x - a.x) - origin->second.x,
               dy = a.y + between * (b.y - a.y) - origin->second.y, turn = origin->second.heading;
  const double error = math::hypot(sample.x - (math::cos(turn) * dx + math::sin(turn) * dy),
                                   sample.y - (math::cos(turn) * dy - math::sin(turn) * dx));
  return std::isnan(error) ? kNoTruth : error;
}

OdometryCheck::Result OdometryCheck::compare(double allowed_m) const {
  Result result;
  for (const Sample& sample : samples_) {
    const double error = error_of(sample);
    ++result.samples;
    result.largest_m = std::max(result.largest_m, error);
    if (result.beyond || error <= allowed_m) continue;
    result.beyond = sample.time;
    result.beyond_m = error;
  }
  return result;
}

}  // namespace ruedo::judge
