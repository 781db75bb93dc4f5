#include "base/base64.h"

#include <algorithm>

#include <openssl/evp.h>

namespace ruedo {

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
