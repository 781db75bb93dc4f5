// YAML as the tree of elements that XML files become, so that the same typed reads name file and
// line. yaml-cpp is used in yaml.cpp only.
#pragma once

#include <memory>
#include <string>

#include "ruedo/element.h"

namespace ruedo::model {

// Keys become names of children, the entries of a list children named "item", scalars texts. Throws
// InputError for what is no YAML, nests too deep or grows too large by its aliases.
std::unique_ptr<Element> parse_yaml(const std::string& text, const std::string& file);

}  // namespace ruedo::model
