// A plugin: a shared library with sensors and drives of one's own, built against an installed
// Ruedo. docs/plugins.md is the story.
//
// Linking the CMake target ruedo::plugin makes one of a library; there is nothing to write for it.
// This is what the program and a plugin agree on.
#pragma once

#include <vector>

#include "ruedo/drive.h"
#include "ruedo/sensor.h"

namespace ruedo {

/// The symbol `ruedo_plugin_entry` of every plugin.
struct PluginEntry {
  const char* abi;  ///< RUEDO_PLUGIN_ABI of the headers that it was built with
  const std::vector<SensorKind>& (*sensors)();  ///< the kinds that it registered
  const std::vector<DriveKind>& (*drives)();    ///< likewise
};

}  // namespace ruedo
