// <experimental:params> in an <include>: changes to the model that is included.
#pragma once

#include <string>

#include "ruedo/element.h"

namespace ruedo::model {

// Adds, modifies, removes and replaces what the children of `params` name by their element_id
// ("LINK::SENSOR") in `model`, as SDF's proposal for parameter passing has it. One that cannot be
// done goes to `findings` as an error, and the others are done.
void apply_params(const Element& params, Element& model, const std::string& where,
                  Findings& findings);

}  // namespace ruedo::model
