// Guesses a robot's drive where no file describes it: from the names, axes and positions of its
// joints.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "world/model/world_model.h"

namespace ruedo::world {

struct GuessedDrive {
  std::unique_ptr<Element> drive;  // null: its joints do not look like a drive
  std::string in_words;            // "differential, left a+b, right c+d"
  std::vector<std::string>
      wheels;  // joints that look like wheels, whether or not they make a drive
};

// controlled: joints that a controller may turn; empty: not known.
GuessedDrive guess_drive(const Model& model, const std::vector<std::string>& controlled);

// The lowest z in the model that a joint and the shapes of its subtree reach, and that of all
// shapes; infinity without one.
double lowest_point_below(const Model& model, ModelJointIndex joint);
double lowest_point(const Model& model);

}  // namespace ruedo::world
