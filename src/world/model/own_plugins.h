// <plugin name="ruedo" filename="NAME">: a user's own plugin with sensors and drives, required by a
// world or model.
#pragma once

#include <vector>

#include "ruedo/element.h"

namespace ruedo::world {

// While one of these lives, this thread's readers load the plugins that a file names, because the
// user chose the file. Models from the network may only name plugins that are already loaded.
class LoadsPlugins {
 public:
  LoadsPlugins();
  ~LoadsPlugins();
  LoadsPlugins(const LoadsPlugins&) = delete;
  LoadsPlugins& operator=(const LoadsPlugins&) = delete;
};

// Loads those of a world's or model's <plugin>s with the name "ruedo" or "ruedo::...". Throws
// InputError.
void load_own_plugins(const std::vector<const Element*>& plugins);

}  // namespace ruedo::world
