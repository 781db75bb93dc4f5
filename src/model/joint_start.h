// Models whose joints begin elsewhere than their files have them: a saved <state>,
// <initial_position>.
#pragma once

#include <vector>

#include "model/world_model.h"

namespace ruedo::model {

// Joints of one axis: those that may begin elsewhere than at 0.
bool has_position(const Joint& joint);

// The position (rad or m) at which a joint of one axis has its child there, as seen from its
// parent; both in the model. Of joints of other kinds 0.
double position_of(const Model& model, const Joint& joint, const Pose& X_MParent,
                   const Pose& X_MChild);

using JointPositions = IndexedVector<ModelJointIndex, double>;  // rad or m

// Moves what each joint carries to these positions (those at the end may be missing: 0).
// The joints' positions count from there: limits, springs and who follows are shifted, and each is
// named.
void begin_at(const JointPositions& positions, const std::string& where, Model& model,
              Findings& findings);

}  // namespace ruedo::model
