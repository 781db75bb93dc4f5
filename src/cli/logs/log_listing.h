// What a log holds, printed for people or as JSON: ruedo info LOG.
#pragma once

#include <string>

namespace ruedo::cli {

// Throws InputError for what is no log.
void print_log(const std::string& path, bool json);

}  // namespace ruedo::cli
