// SHA-256 (FIPS 180-4), for the hashes of a run's files in its log; `sha256sum FILE` prints the
// same digits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace ruedo {

// 64 hexadecimal digits.
std::string sha256(const uint8_t* data, size_t size);

// Of a file's bytes; "" when it cannot be read, is no regular file, or is larger than 4 GB.
std::string sha256_of_file(const std::string& path);

}  // namespace ruedo
