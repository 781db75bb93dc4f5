// Prints the contents of a log, for people or as JSON: ruedo info LOG.
#pragma once

#include <string>

namespace ruedo::cli {

// Throws InputError if the file is not a log.
void print_log(const std::string& path, bool json);

}  // namespace ruedo::cli
