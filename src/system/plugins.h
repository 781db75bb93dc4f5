// Plugins: shared libraries with sensors and drives of a user's own (include/ruedo/plugin.h).
//
// They are code, and do what they like; so only the user says which are loaded: by a file, or by a
// folder in which worlds may name them. What a world or a log names is looked for there and nowhere
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
// already changes nothing. Throws InputError that names the file: it cannot be read, is no shared
// library, is no plugin, is one for another version, throws or is written anew while it is loaded,
// or has a kind that there is already.
Plugin load_plugin(const std::string& path);

// The plugin that a world names: one that is loaded, else the file of that name in a folder of
// RUEDO_PLUGIN_PATH. "" when there is none. "NAME" stands for "libNAME.so", too.
std::string find_plugin(const std::string& name);

// The folders of RUEDO_PLUGIN_PATH.
std::vector<std::string> plugin_folders();

// All that are loaded, by name.
std::vector<Plugin> loaded_plugins();

}  // namespace ruedo
