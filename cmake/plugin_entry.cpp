// Compiled into every plugin by CMake's target ruedo::plugin: what it was built for, and where its
// kinds are.
#include "ruedo/plugin.h"
#include "ruedo/plugin_abi.h"

namespace {

// Also read from the file by who is going to load it.
constexpr char kBuiltFor[] = RUEDO_PLUGIN_MARK RUEDO_PLUGIN_ABI;

}  // namespace

extern "C" [[gnu::visibility("default"), gnu::used]] const ruedo::PluginEntry ruedo_plugin_entry{
    kBuiltFor + sizeof(RUEDO_PLUGIN_MARK) - 1, &ruedo::sensor_kinds, &ruedo::drive_kinds};
