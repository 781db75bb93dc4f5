// Odometry against the truth: each sample with the true pose at its stamp.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "ruedo/odometry_t.hpp"
#include "ruedo/pose.h"
#include "ruedo/sim_time.h"

namespace ruedo::judge {

// A sample's stamp need not be that of a state (a robot's clock may drift): the truth is
// interpolated between states, and held before the first and after the last one.
class OdometryCheck {
 public:
  // base_link at that time, and how often the odometry was reset by then. A time that is not after
  // the last one restarts the check: sim time was reset.
  void see_truth(SimTime time, const Pose& X_WBase, int32_t resets);
  void see(const odometry_t& sample);

  struct Result {
    int64_t samples = 0;
    double largest_m = 0.0;         // of all samples
    std::optional<SimTime> beyond;  // the first sample that is farther off than allowed
    double beyond_m = 0.0;
  };
  Result compare(double allowed_m) const;

 private:
  struct Place {
    SimTime time;
    double x, y, heading;
  };
  struct Part {  // of the run: another one each time that sim time is reset
    std::vector<Place> truth;
    std::map<int32_t, Place> origins;  // of the frame of odometry, by the number of resets
  };
  struct Sample {
    SimTime time;
    double x, y;
    int32_t resets;
    size_t part;
  };
  double error_of(const Sample& sample) const;  // m

  std::vector<Part> parts_;
  std::vector<Sample> samples_;
};

}  // namespace ruedo::judge
