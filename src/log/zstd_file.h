// Files packed by zstd, in one stream: the memory does not grow with them.
#pragma once

#include <cstdint>
#include <string>

namespace ruedo::log {

// Throws InputError for what cannot be read, EnvironmentError for what cannot be written.
void pack_file(const std::string& from, const std::string& to);

// Of a file, `size` bytes from `offset` on. Returns how many bytes `to` has then. Throws as
// pack_file() does, also for what is damaged, or unpacks to more than max_bytes.
uint64_t unpack_part(const std::string& from, uint64_t offset, uint64_t size, const std::string& to,
                     uint64_t max_bytes);

}  // namespace ruedo::log
