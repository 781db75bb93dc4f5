// Drives that are complete, and cannot mean what they say.
#pragma once

#include <string>

#include "world/model/world_model.h"
#include "world/read/read_context.h"

namespace ruedo::world {

// Whether a drive of that steering has the element: "ruedo:wheelbase".
bool steering_has(DriveDescription::Steering steering, const std::string& element);

// Reports a drive of a model that stands still or goes its own way, wheels that cannot roll, or
// that follow something else, too, and elements of a <ruedo:drive> that its steering does not have.
void name_odd_drive(const Element& model_element, const Model& model, const std::string& where,
                    Findings& findings);

}  // namespace ruedo::world
