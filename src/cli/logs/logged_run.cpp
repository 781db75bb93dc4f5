// The inverse of result_options(), and of what ruedo run adds to them.
#include "cli/logs/logged_run.h"

#include "cli/support/extensions.h"
#include "log/header.h"
#include "ruedo/errors.h"

namespace ruedo::cli {

LoggedOptions read_options(const log_header_t& header, const std::string& log) {
  if (header.files.empty()) throw InputError({log}, "names no file that its world was made from");
  if (const std::string fault = log::fault_of_names(header); !fault.empty())
    throw InputError({log}, fault);
  LoggedOptions options;
  WorldArguments& world = options.world;
  world.world = header.files.front().path;
  for (const std::string& option : header.options) {
    const size_t equals = option.find('=');
    const std::string name = option.substr(0, equals),
                      value = equals == std::string::npos ? "" : option.substr(equals + 1);
    if (name == "--plugin")
      load_logged_plugin(value, log);
    else if (name == "--spawn")
      world.spawns.push_back(value);
    else if (name == "--drive")
      world.drives.push_back(value);
    else if (name == "--xacro-arg")
      world.xacro_arguments.push_back(value);
    else if (name == "--allow-absolute")
      continue;  // not a log's to allow: what lies outside is not found
    else if (name == "--set")
      world.settings.push_back(value);
    else if (name == "--disable")
      world.disabled.push_back(value);
    else if (name == "--fault")
      world.faults.push_back(value);
    else if (name == "--no-noise")
      world.no_noise = true;
    else if (name == "--fast-pixels")
      world.fast_pixels = true;
    else if (name == "--mesa-environment")
      world.mesa_environment = true;  // with the variables that are set here
    else if (name == "--remap")
      options.remaps.push_back(with_options_of(log, [&] { return parse_remap(value); }));
    else
      throw InputError({log},
                       "its run had the option " + option + ", which this version does not know");
  }
  return options;
}

run::LoggedRun load_run(const log_header_t& header, const std::string& log) {
  LoggedOptions options = read_options(header, log);
  run::LoggedRun run;
  try {
    log::check_files(header, log);
  } catch (const InputError& error) {
    run.warning = std::string("The world may not be the recorded one: ") + error.what();
  }
  run.world = with_options_of(log, [&] { return load(options.world); });
  run.disabled = std::move(options.world.disabled);
  run.remaps = std::move(options.remaps);
  return run;
}

}  // namespace ruedo::cli
