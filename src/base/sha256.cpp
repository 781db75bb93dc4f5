// OpenSSL's digests, in a context of our own: they do not depend on the host's configuration.
#include "base/sha256.h"

#include <cstdio>
#include <memory>
#include <vector>

#include <openssl/crypto.h>
#include <openssl/evp.h>

#include "base/input_file.h"
#include "ruedo/errors.h"

namespace ruedo {
namespace {

constexpr int64_t kMostBytes = int64_t{4} << 30;  // of a file that a world was made from

// Not the library's usual context, in which a host's openssl.cnf may have switched SHA-256 off.
// The default provider is part of the library.
OSSL_LIB_CTX* context() {
  static OSSL_LIB_CTX* const own = ::OSSL_LIB_CTX_new();
  return own;
}

void require(bool done) {
  if (!done)
    throw EnvironmentError(
        "this machine's OpenSSL (libcrypto) cannot compute SHA-256, by which Ruedo recognises "
        "changed files");
}

class Digest {
 public:
  Digest() {
    static EVP_MD* const method = ::EVP_MD_fetch(context(), "SHA256", nullptr);
    require(method != nullptr && ::EVP_DigestInit_ex(state_.get(), method, nullptr) == 1);
  }

  void add(const uint8_t* data, size_t size) {
    require(::EVP_DigestUpdate(state_.get(), data, size) == 1);
  }

  std::string hex() {
    Sha256 bytes{};
    unsigned size = 0;
    require(::EVP_DigestFinal_ex(state_.get(), bytes.data(), &size) == 1 && size == bytes.size());
    std::string text;
    for (const uint8_t byte : bytes) {
      text += "0123456789abcdef"[byte >> 4];
      text += "0123456789abcdef"[byte & 15];
    }
    return text;
  }

 private:
  struct Free {
    void operator()(EVP_MD_CTX* state) const { ::EVP_MD_CTX_free(state); }
  };
  std::unique_ptr<EVP_MD_CTX, Free> state_{::EVP_MD_CTX_new()};
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

Sha256 hmac_sha256(std::span<const uint8_t> key, std::span<const uint8_t> bytes) {
  Sha256 code{};
  size_t size = 0;
  require(::EVP_Q_mac(context(), "HMAC", nullptr, "SHA256", nullptr, key.data(), key.size(),
                      bytes.data(), bytes.size(), code.data(), code.size(), &size) != nullptr &&
          size == code.size());
  return code;
}

}  // namespace ruedo
