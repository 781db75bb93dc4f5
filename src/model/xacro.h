// xacro: robots as macros, expanded by the Python package of that name in a child process with
// limits (xacro/expand.py). xacro evaluates Python, so that a reader of our own could only read a
// part of it; ROS is not needed for it.
#pragma once

#include <memory>
#include <string>

#include "model/read_context.h"

namespace ruedo::model {

// Whether a file is one: by its name, or because its <robot> has elements of xacro.
bool is_xacro(const std::string& path, const Element* root);

// The Python that expands it: a path, or a name for the search path.
std::string xacro_python();

// The <robot> that it expands to; its elements name the files and lines where they were written.
// $(find PKG) finds packages by their package.xml. What it includes and is not there is named.
// Throws InputError.
std::shared_ptr<const Element> expand_xacro(const std::string& path, ReadContext& context);

}  // namespace ruedo::model
