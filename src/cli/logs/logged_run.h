// The run that a log was made by: the options in its header, as its command line had them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/option_text.h"
#include "cli/support/commands.h"
#include "ruedo/errors.h"
#include "ruedo/log_header_t.hpp"
#include "run/repeat/log_worlds.h"

namespace ruedo::cli {

struct LoggedOptions {
  WorldArguments world;
  std::vector<std::pair<std::string, std::string>> remaps;
};

// log: names it in messages. Throws InputError for a header without a world, or with an option that
// is not known.
LoggedOptions read_options(const log_header_t& header, const std::string& log);

// The result of `repeat`. The user did not type its options, the log has them: an InputError for
// one names the log.
template <typename Repeat>
auto with_options_of(const std::string& log, Repeat repeat) {
  try {
    return repeat();
  } catch (const InputError& error) {
    if (!error.source().file.empty() && !is_option(error.source())) throw;
    throw InputError({log}, std::string("its run had ") + error.what());
  }
}

// The run to show. A world whose files were changed is shown as it is now, with a warning. Throws
// InputError, too, when the world cannot be read.
run::LoggedRun load_run(const log_header_t& header, const std::string& log);

}  // namespace ruedo::cli
