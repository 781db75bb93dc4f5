// The wind: uniform in space, with the model of Gazebo's plugin WindEffects.
//
// Model: with t since the start of the run, and from the file's velocity the horizontal speed s,
// the direction d and the vertical speed z,
//   speed     = s (1 - exp(-t / rise)) (1 + swing sin(2 pi t / swing_period)) + noise
//   direction = d + turn sin(2 pi t / turn_period) + noise
//   vertical  = z (1 - exp(-t / vertical_rise)) + noise,
// where noise is N(mean, stddev), drawn independently in each step. Gazebo's filter accumulates
// over steps what is in closed form here. Without the plugin it is the file's velocity, and pushes
// nothing.
#pragma once

#include "ruedo/random.h"
#include "world/model/world_model.h"

namespace ruedo::robot {

class Wind {
 public:
  Wind(const world::Wind& description, uint64_t seed);

  // m/s, world, at the end of that step; 0 is the start of the run.
  Vec3 at(int64_t step, SimTime step_us) const;
  void reseed(uint64_t seed) { random_.reseed(seed); }

 private:
  world::Wind wind_;
  double speed_, direction_;
  RandomSource random_;
};

}  // namespace ruedo::robot
