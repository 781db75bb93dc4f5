// Message types of a user's own, by their .lcm files: what prints, compares and exports messages
// then knows them, too.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "ruedo/schema.h"

namespace ruedo {

// The largest type that is read, so that no small file makes a large one: .lcm files of 1 MiB,
// structs in structs (ours go three deep), dimensions of an array, and fields of a struct with
// those of all that it holds.
constexpr size_t kMostTypeBytes = size_t{1} << 20;
constexpr int kMostTypeDepth = 16;
constexpr size_t kMostTypeDimensions = 16;
constexpr size_t kMostTypeFields = 10'000;

// A message with more fields than that, mostly empty arrays of structs in arrays, does not decode
// as its type.
constexpr size_t kMostFieldsOfByte = 16;

// Reads .lcm files, and those of folders; find_schema(fingerprint) finds their types from then on.
// They may hold types of Ruedo's. Once, before any thread asks. Throws InputError with file and
// line, or with the type.
void read_types(const std::vector<std::string>& places);

// Those that were read; empty before.
std::span<const Schema> read_schemas();

}  // namespace ruedo
