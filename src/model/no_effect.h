// Elements of SDF that change what Gazebo does and nothing here.
#pragma once

#include "ruedo/element.h"

namespace ruedo::model {

// Names them, below an <sdf> element, where they say more than the format's own default. What
// readers name themselves is not among them; what no result depends on is not named
// (docs/world-files.md has both lists).
void name_what_has_no_effect(const Element& sdf, Findings& findings);

}  // namespace ruedo::model
