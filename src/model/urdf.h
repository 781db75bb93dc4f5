// URDF robots: read by urdfdom, handed on as the SDF model that says the same, so that one reader
// serves both.
#pragma once

#include <memory>

#include "ruedo/element.h"

namespace ruedo::model {

// The <model> for a <robot>; elements keep the file and line of what they were. Throws InputError
// for what urdfdom refuses and for xacro that is not expanded.
std::unique_ptr<Element> urdf_as_sdf(const Element& robot, Findings& findings);

}  // namespace ruedo::model
