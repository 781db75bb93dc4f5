// A recorded run as one HTML file that needs no server: the page, the scene, and as many of the
// log's messages as fit.
#pragma once

#include <cstddef>
#include <string>

#include "run/repeat/log_worlds.h"

namespace ruedo::console {

struct LogPage {
  size_t bytes = 0;  // of the file
  // least time between two messages of a channel in the file; 0: all are in it
  double interval_s = 0;
  double pictures_s = 0;  // the same for pictures
  std::string fault;      // "", or what cannot be shown, and why
};

// Writes a log as a page of at most that many bytes: if not all messages fit, they are thinned
// equally on all channels, and pictures more. Throws InputError for a file that is not a log or if
// even the scene does not fit, and EnvironmentError if the file cannot be written.
LogPage write_log_page(const std::string& log, const run::LoadRun& load, const std::string& path,
                       size_t most_bytes);

}  // namespace ruedo::console
