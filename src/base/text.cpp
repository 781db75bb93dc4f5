#include "base/text.h"

#include <openssl/evp.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/whole.h"

namespace ruedo {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r\n\f\v";
  const size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kSpace) - begin + 1);
}

std::string shown(double value) {
  if (value == std::floor(value) && std::abs(value) < 1e15) return std::to_string(whole(value));
  char buffer[32];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, result.ptr};
}

std::string base64(std::span<const uint8_t> bytes) {
  constexpr size_t kBlock = size_t{3}
                            << 20;  // OpenSSL counts in int; a multiple of 3 has no padding
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');  // and the zero that OpenSSL adds
  size_t written = 0;
  for (size_t at = 0; at < bytes.size(); at += kBlock) {
    const auto block = bytes.subspan(at, std::min(kBlock, bytes.size() - at));
    written += static_cast<size_t>(
        ::EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()) + written, block.data(),
                          static_cast<int>(block.size())));
  }
  text.resize(written);
  return text;
}

}  // namespace ruedo
