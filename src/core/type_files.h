// Message types of a user's own, by their .lcm files: what prints, compares and exports messages
// then knows them, too.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "ruedo/schema.h"

namespace ruedo {

// Reads .lcm files, and those of folders; find_schema(fingerprint) finds their types from then on.
// They may hold types of Ruedo's. Once, before any thread asks. Throws InputError with file and
// line.
void read_types(const std::vector<std::string>& places);

// Those that were read; empty before.
std::span<const Schema> read_schemas();

}  // namespace ruedo
