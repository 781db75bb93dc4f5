// Degrees where radians are meant.
#pragma once

#include "ruedo/element.h"

namespace ruedo::model {

// Names the rotations and limits of joints below the root of a document, SDF or URDF, whose numbers
// read as degrees: whole multiples of 5 beyond a turn in radians. They are taken as they are
// written.
void name_degrees(const Element& root, Findings& findings);

}  // namespace ruedo::model
