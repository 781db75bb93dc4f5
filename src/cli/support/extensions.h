// Options for what users bring of their own: plugins, and message types.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace ruedo::cli {

// --plugin FILE.
void add_plugin_argument(CLI::App& command);
// Those that were given, each once. load() does it, too; commands with --sandbox before they enter
// it, since the user's own files may lie anywhere.
void load_given_plugins();
// Of those that are loaded, for a log's header: "--plugin=NAME@SHA256".
std::vector<std::string> plugin_options();
// The plugin of such an option, for which a log's run is repeated: one that was given, or that
// RUEDO_PLUGIN_PATH leads to. Throws InputError that names the log.
void load_logged_plugin(const std::string& option, const std::string& log);

// --types PLACE: .lcm files, or folders of them.
void add_types_argument(CLI::App& command);
void read_given_types();

}  // namespace ruedo::cli
