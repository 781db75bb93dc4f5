// A recorded run as one HTML file, which needs no server: the page, the scene, and as many of the
// log's messages as there is room for.
#pragma once

#include <cstddef>
#include <string>

#include "run/log_worlds.h"

namespace ruedo::console {

struct LogPage {
  size_t bytes = 0;       // of the file
  double interval_s = 0;  // least time between two messages of a channel that are in it; 0: all are
  double pictures_s = 0;  // the same for pictures
  std::string fault;      // "" or what cannot be shown, and why
};

// Writes a log as a page of at most so many bytes: where there is no room for all messages, they
// are thinned alike on all channels, and pictures more. Throws InputError for what is no log and
// where even the scene has no room, EnvironmentError when the file cannot be written.
LogPage write_log_page(const std::string& log, const run::LoadRun& load, const std::string& path,
                       size_t most_bytes);

}  // namespace ruedo::console
