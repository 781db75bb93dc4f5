// SDF elements that change what Gazebo does, but have no effect here.
#pragma once

#include "ruedo/element.h"

namespace ruedo::world {

// Reports them below an <sdf> element where they differ from the format's default. Excludes what
// the readers report themselves, and what no result depends on (docs/world-files.md lists both).
void name_what_has_no_effect(const Element& sdf, Findings& findings);

}  // namespace ruedo::world
