// Bytes as text.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace ruedo {

// RFC 4648's base64, padded, without line ends.
std::string base64(std::span<const uint8_t> bytes);

}  // namespace ruedo
