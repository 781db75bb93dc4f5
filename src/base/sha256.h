// SHA-256 (FIPS 180-4), for the hashes of a run's files in its log; `sha256sum FILE` prints the
// same digits.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace ruedo {

using Sha256 = std::array<uint8_t, 32>;

// All throw EnvironmentError where the machine's OpenSSL cannot compute one.

// 64 hexadecimal digits.
std::string sha256(const uint8_t* data, size_t size);

// Of a file's bytes; "" when it cannot be read, is no regular file, or is larger than 4 GB.
std::string sha256_of_file(const std::string& path);

// HMAC with SHA-256 (FIPS 198-1).
Sha256 hmac_sha256(std::span<const uint8_t> key, std::span<const uint8_t> bytes);

}  // namespace ruedo
