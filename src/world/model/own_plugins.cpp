#include "world/model/own_plugins.h"

#include <algorithm>

#include "system/plugins.h"

namespace ruedo::world {
namespace {

thread_local int loading = 0;

bool is_own(const Element& plugin) {
  const std::string* name = plugin.attribute("name");
  return name && (*name == "ruedo" || name->starts_with("ruedo::"));
}

bool is_loaded(const std::string& file) {
  const std::vector<Plugin> loaded = loaded_plugins();
  return std::any_of(loaded.begin(), loaded.end(),
                     [&](const Plugin& plugin) { return plugin.path == file; });
}

}  // namespace

LoadsPlugins::LoadsPlugins() { ++loading; }
LoadsPlugins::~LoadsPlugins() { --loading; }

void load_own_plugins(const std::vector<const Element*>& plugins) {
  for (const Element* plugin : plugins) {
    if (!is_own(*plugin)) continue;
    const std::string* filename = plugin->attribute("filename");
    const std::string name = filename ? *filename : "";
    if (name.empty() || name.find('/') != std::string::npos) {
      plugin->fail(
          "filename '" + name +
          "' is not allowed; allowed is the name of a file in a folder of RUEDO_PLUGIN_PATH");
    }
    const std::string file = find_plugin(name);
    if (file.empty()) {
      plugin->fail("the plugin '" + name +
                   "' is in no folder of RUEDO_PLUGIN_PATH, and was not given by --plugin FILE");
    }
    if (is_loaded(file)) continue;
    if (loading == 0)
      plugin->fail("the plugin '" + name + "' is not loaded: start the run with --plugin FILE");
    load_plugin(file);
  }
}

}  // namespace ruedo::world
