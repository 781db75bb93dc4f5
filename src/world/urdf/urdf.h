// URDF robots: parsed by urdfdom and converted to an equivalent SDF model, so that one reader
// serves both.
#pragma once

#include <memory>

#include "ruedo/element.h"

namespace ruedo::world {

// The <model> for a <robot>; its elements keep the original file and line. Throws InputError for
// what urdfdom refuses, and for unexpanded xacro.
std::unique_ptr<Element> urdf_as_sdf(const Element& robot, Findings& findings);

}  // namespace ruedo::world
