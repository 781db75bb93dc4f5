// Domain randomisation: what of a world is drawn again for each seed, and from which distributions.
//
// A description is a list of draws, TARGET=DISTRIBUTION, as --randomize and ruedo.Engine take them.
// What a seed gives depends on the seed and the target alone: not on the other draws, nor on their
// order.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "model/world_model.h"

namespace ruedo::model {

struct Distribution {
  enum class Kind { uniform, log_uniform, normal, choice };
  Kind kind = Kind::uniform;
  std::vector<double> parameters;  // low and high; mean and standard deviation; the values
};

// Targets are
// - MODEL.x, .y, .z (m) and .yaw (rad): where it stands at the start. Robots that are put somewhere
// are drawn again while they would share space with something.
// - MODEL.mass: a factor for the masses and inertias of its links.
// - MODEL.friction: the friction coefficient of all of its collisions.
// - LIGHT.brightness: a factor for the intensity of one of the world's lights.
// - ROBOT/DEVICE.KEY: as --set has it.
// "*" in MODEL or LIGHT matches any text; each match draws for itself.
struct Draw {
  std::string target;
  Distribution distribution;
};

// TARGET=uniform(LOW,HIGH), log_uniform(LOW,HIGH), normal(MEAN,STDDEV) or choice(VALUE,...). Throws
// InputError.
Draw parse_draw(const std::string& text);

// What was drawn: the target, with the model's own name, and its value.
using Drawn = std::vector<std::pair<std::string, double>>;

// The world of that seed. What is not drawn is shared with `world`. Throws InputError for a target
// that is not there, a value that its reader refuses, and a robot for which no free place was
// found.
std::shared_ptr<const WorldModel> randomized(const WorldModel& world,
                                             const std::vector<Draw>& draws, uint64_t seed,
                                             Drawn* drawn = nullptr);

}  // namespace ruedo::model
