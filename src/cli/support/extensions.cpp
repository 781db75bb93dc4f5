#include "cli/support/extensions.h"

#include <CLI/CLI.hpp>

#include "base/sha256.h"
#include "base/type_files.h"
#include "ruedo/errors.h"
#include "system/plugins.h"

namespace ruedo::cli {
namespace {

// The options of the command line: a process has one.
std::vector<std::string> plugin_files, type_places;

}  // namespace

void add_plugin_argument(CLI::App& command) {
  command
      .add_option("--plugin", plugin_files, "a shared library with sensors or drives of your own")
      ->type_name("FILE")
      ->allow_extra_args(false);
}

void load_given_plugins() {
  for (const std::string& file : plugin_files) load_plugin(file);
}

std::vector<std::string> plugin_options() {
  std::vector<std::string> options;
  for (const Plugin& plugin : loaded_plugins())
    options.push_back("--plugin=" + plugin.name + "@" + plugin.sha256);
  return options;
}

// A log may be untrusted, so it has a plugin's name without its path. wanted: NAME@SHA256.
void load_logged_plugin(const std::string& wanted, const std::string& log) {
  const std::string name = wanted.substr(0, wanted.rfind('@')),
                    hash = name.size() < wanted.size() ? wanted.substr(name.size() + 1) : "";
  const std::string file = find_plugin(name);
  if (file.empty()) {
    throw InputError({log},
                     "its run had the plugin " + name +
                         ", which is in no folder of RUEDO_PLUGIN_PATH; --plugin FILE gives it");
  }
  // The loaded library may be older than the file, if that was rewritten.
  if (sha256_of_file(file) != hash || load_plugin(file).sha256 != hash)
    throw InputError(
        {log}, "its run had another " + name + " than " + file + " (its sha256 was " + hash + ")");
}

void add_types_argument(CLI::App& command) {
  command
      .add_option("--types", type_places,
                  "an .lcm file, or a folder of them, with message types of your own")
      ->type_name("PLACE")
      ->allow_extra_args(false);
}

void read_given_types() { read_types(type_places); }

}  // namespace ruedo::cli
