// OpenSSL's EVP digests.
#include "base/sha256.h"

#include <array>
#include <cstdio>
#include <memory>
#include <vector>

#include <openssl/evp.h>

#include "base/input_file.h"
#include "ruedo/errors.h"

namespace ruedo {
namespace {

constexpr int64_t kMostBytes = int64_t{4} << 30;  // of a file that a world was made from

class Digest {
 public:
  Digest() { EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr); }

  void add(const uint8_t* data, size_t size) { EVP_DigestUpdate(context_.get(), data, size); }

  std::string hex() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> bytes{};
    unsigned size = 0;
    EVP_DigestFinal_ex(context_.get(), bytes.data(), &size);
    std::string text;
    for (unsigned i = 0; i < size; ++i) {
      text += "0123456789abcdef"[bytes[i] >> 4];
      text += "0123456789abcdef"[bytes[i] & 15];
    }
    return text;
  }

 private:
  struct Free {
    void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
  };
  std::unique_ptr<EVP_MD_CTX, Free> context_{EVP_MD_CTX_new()};
};

}  // namespace

std::string sha256(const uint8_t* data, size_t size) {
  Digest digest;
  digest.add(data, size);
  return digest.hex();
}

std::string sha256_of_file(const std::string& path) {
  InputFile input;
  try {
    input = open_input(path);
  } catch (const InputError&) {
    return "";
  }
  if (input.size > kMostBytes) return "";
  Digest digest;
  std::vector<uint8_t> piece(1 << 16);
  while (const size_t got = std::fread(piece.data(), 1, piece.size(), input.file.get()))
    digest.add(piece.data(), got);
  return std::ferror(input.file.get()) ? "" : digest.hex();
}

}  // namespace ruedo
