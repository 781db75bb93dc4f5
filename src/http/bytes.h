// Bytes that several threads, and many connections, may hold at once.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

namespace ruedo::http {

using Bytes = std::shared_ptr<const std::vector<uint8_t>>;

inline Bytes bytes_of(std::string_view text) {
  return std::make_shared<const std::vector<uint8_t>>(text.begin(), text.end());
}

}  // namespace ruedo::http
