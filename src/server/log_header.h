// The header of a log: what the run was made from, and the machine's part in its bytes.
#pragma once

#include <string>
#include <vector>

#include "model/world_model.h"
#include "ruedo/log_header_t.hpp"

namespace ruedo::server {

// The vector extensions of this CPU that glibc or the renderer choose code by.
std::string cpu_features();
std::string libc_version();
// Those shared libraries of this process that compute what goes into messages, by file name with version, sorted.
std::vector<std::string> libraries_that_matter();

// options: those that change the result, as on the command line.
log_header_t make_log_header(const model::WorldModel& world, uint64_t seed, const std::vector<std::string>& options);

}  // namespace ruedo::server
