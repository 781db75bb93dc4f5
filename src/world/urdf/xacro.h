// xacro: robots as macros, expanded by the Python package of that name in a child process with
// limits (xacro/expand.py). xacro evaluates Python, so a reader of our own could support only a
// part of it, and any Python: the child has a sandbox of its own. ROS is not needed.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "world/read/read_context.h"

namespace ruedo::world {

// Whether a file is xacro: by its name, or because its <robot> contains xacro elements.
bool is_xacro(const std::string& path, const Element* root);

// The Python interpreter that expands it: a path, or a name to be found in PATH.
std::string xacro_python();

// The interpreter, then the files that it reads of its own; empty without one.
std::vector<std::string> xacro_parts();

// The expanded <robot>; its elements keep the original files and lines. $(find PKG) finds packages
// by their package.xml. Missing includes are reported. Throws InputError.
std::shared_ptr<const Element> expand_xacro(const std::string& path, ReadContext& context);

}  // namespace ruedo::world
