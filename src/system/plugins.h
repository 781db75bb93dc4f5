// Plugins: shared libraries with sensors and drives of a user's own (include/ruedo/plugin.h).
//
// They are code, and may do anything; so only the user chooses which are loaded: by a file, or by a
// folder in which worlds may name them. Plugins of a world or a log are searched there and nowhere
// else.
#pragma once

#include <string>
#include <vector>

namespace ruedo {

struct Plugin {
  std::string name;    // of the file, without its folder
  std::string path;    // absolute
  std::string sha256;  // of the file
};

// Loads a plugin, and adds its kinds to sensor_kinds() and drive_kinds(); a file that is loaded
// already changes nothing. Throws InputError that names the file if it cannot be read, is not a
// shared library or a plugin, is for another version, throws or is rewritten while it is loaded,
// or has a kind that exists already.
Plugin load_plugin(const std::string& path);

// The plugin of that name in a world: a loaded one, else the file of that name in a folder of
// RUEDO_PLUGIN_PATH. "" without one. "NAME" means "libNAME.so", too.
std::string find_plugin(const std::string& name);

// The folders of RUEDO_PLUGIN_PATH.
std::vector<std::string> plugin_folders();

// All that are loaded, by name.
std::vector<Plugin> loaded_plugins();

}  // namespace ruedo
