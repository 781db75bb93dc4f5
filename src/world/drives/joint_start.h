// Models whose joints start elsewhere than in their files: a saved <state>, <initial_position>.
#pragma once

#include <vector>

#include "world/model/world_model.h"

namespace ruedo::world {

// Joints with one axis: those that may start elsewhere than at 0.
bool has_position(const Joint& joint);

// The position (rad or m) at which a joint with one axis puts its child there, relative to its
// parent; both poses in the model. 0 for other joints.
double position_of(const Model& model, const Joint& joint, const Pose& X_MParent,
                   const Pose& X_MChild);

using JointPositions = IndexedVector<ModelJointIndex, double>;  // rad or m

// Moves what each joint carries to these positions (missing ones at the end count as 0). Positions
// count from there: limits, springs and mimic offsets are shifted accordingly, and each shift is
// reported.
void begin_at(const JointPositions& positions, const std::string& where, Model& model,
              Findings& findings);

}  // namespace ruedo::world
