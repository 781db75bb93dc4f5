// <plugin name="ruedo" filename="NAME">: a plugin with sensors and drives of a user's own, which a
// world or model needs.
#pragma once

#include <vector>

#include "ruedo/element.h"

namespace ruedo::model {

// While one of these lives, this thread's readers load the plugins that a file names: it is one
// that the user named. Models that come over a network may name those that are loaded.
class LoadsPlugins {
 public:
  LoadsPlugins();
  ~LoadsPlugins();
  LoadsPlugins(const LoadsPlugins&) = delete;
  LoadsPlugins& operator=(const LoadsPlugins&) = delete;
};

// Of a world's or model's <plugin>s those that are named "ruedo" or "ruedo::...". Throws
// InputError.
void load_own_plugins(const std::vector<const Element*>& plugins);

}  // namespace ruedo::model
