// What a robot's drive is where no file says it: from the names, the axes and the places of its
// joints.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/world_model.h"

namespace ruedo::model {

struct GuessedDrive {
  std::unique_ptr<Element> drive;  // null: its joints do not look like those of a drive
  std::string in_words;            // "differential, left a+b, right c+d"
  std::vector<std::string>
      wheels;  // joints that look like wheels, whether a drive came of them or not
};

// controlled: joints that a controller may turn; empty: nothing is known of that.
GuessedDrive guess_drive(const Model& model, const std::vector<std::string>& controlled);

// Whether something of a joint's subtree reaches down to the height z in the model.
double lowest_point_below(const Model& model, ModelJointIndex joint);

}  // namespace ruedo::model
