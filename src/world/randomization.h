// Domain randomisation: what of a world is drawn for each seed, and from which distributions.
//
// A description is a list of draws, TARGET=DISTRIBUTION, as taken by --randomize and ruedo.Engine.
// The value for a seed depends on the seed and the target alone, not on other draws or their order.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "world/model/world_model.h"

namespace ruedo::world {

struct Distribution {
  enum class Kind { uniform, log_uniform, normal, choice };
  Kind kind = Kind::uniform;
  std::vector<double> parameters;  // low and high; mean and standard deviation; the values
};

// Targets are
// - MODEL.x, .y, .z (m) and .yaw (rad): the start pose. A robot is drawn again as long as it would
// overlap something.
// - MODEL.mass: a factor for the masses and inertias of its links.
// - MODEL.friction: the friction coefficient of all of its collisions.
// - LIGHT.brightness: a factor for the intensity of one of the world's lights.
// - ROBOT/DEVICE.KEY: as in --set.
// "*" in MODEL or LIGHT matches any text; each match is drawn separately.
struct Draw {
  std::string target;
  Distribution distribution;
};

// TARGET=uniform(LOW,HIGH), log_uniform(LOW,HIGH), normal(MEAN,STDDEV) or choice(VALUE,...). Throws
// InputError.
Draw parse_draw(const std::string& text);

// A draw: the target, with the model's own name, and its value.
using Drawn = std::vector<std::pair<std::string, double>>;

// The world for a seed. Parts that are not drawn are shared with `world`. Throws InputError for a
// target that does not exist, a value that its reader refuses, and a robot without a free
// place.
std::shared_ptr<const WorldModel> randomized(const WorldModel& world,
                                             const std::vector<Draw>& draws, uint64_t seed,
                                             Drawn* drawn = nullptr);

}  // namespace ruedo::world
