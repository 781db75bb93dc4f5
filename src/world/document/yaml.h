// YAML as the same trees of elements that XML files become, so that typed reads report file and
// line. yaml-cpp is used in yaml.cpp only.
#pragma once

#include <memory>
#include <string>

#include "ruedo/element.h"

namespace ruedo::world {

// Keys become names of children, list entries become children named "item", and scalars become
// texts. Dots in the names of ROS 2's parameters are levels. Throws InputError for text that is not
// YAML, nests too deep, or grows too large by aliases.
std::unique_ptr<Element> parse_yaml(const std::string& text, const std::string& file);

}  // namespace ruedo::world
