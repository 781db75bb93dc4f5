// <experimental:params> in an <include>: changes to the model that is included.
#pragma once

#include <string>

#include "ruedo/element.h"

namespace ruedo::world {

// Adds, modifies, removes and replaces elements of `model`. Each child of `params` names one by its
// element_id ("LINK::SENSOR"), as in SDF's proposal for parameter passing. A change that cannot be
// made goes to `findings` as an error; the others are made.
void apply_params(const Element& params, Element& model, const std::string& where,
                  Findings& findings);

}  // namespace ruedo::world
