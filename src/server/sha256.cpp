// SHA-256, written from FIPS 180-4, sections 4 to 6.
#include "server/sha256.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

namespace ruedo::server {
namespace {

// The constants are the first 32 bits of the fractional parts of the cube roots (of the square roots, for the first
// hash) of the first primes: whole numbers, found here by integer roots.
__extension__ typedef unsigned __int128 Wide;

uint32_t root_fraction(uint64_t prime, int degree) {
  // The largest r with r^degree <= prime * 2^(32 * degree); its low 32 bits are the fraction.
  uint64_t root = 0;
  for (int bit = 36; bit >= 0; --bit) {
    const uint64_t trial = root | uint64_t{1} << bit;
    Wide power = trial;
    for (int i = 1; i < degree; ++i) power *= trial;
    if (power <= static_cast<Wide>(prime) << (32 * degree)) root = trial;
  }
  return static_cast<uint32_t>(root);
}

struct Constants {
  std::array<uint32_t, 64> k;
  std::array<uint32_t, 8> first;
  Constants() {
    size_t found = 0;
    for (uint64_t n = 2; found < 64; ++n) {
      bool prime = true;
      for (uint64_t d = 2; d * d <= n; ++d) prime &= n % d != 0;
      if (!prime) continue;
      if (found < 8) first[found] = root_fraction(n, 2);
      k[found++] = root_fraction(n, 3);
    }
  }
};

class Sha256 {
 public:
  Sha256() : hash_(constants().first) {}

  void add(const uint8_t* data, size_t size) {
    total_ += size;
    while (size > 0) {
      const size_t part = std::min(size, block_.size() - used_);
      std::memcpy(block_.data() + used_, data, part);
      used_ += part, data += part, size -= part;
      if (used_ == block_.size()) mix();
    }
  }

  std::string digits() {
    const uint64_t bits = total_ * 8;
    const uint8_t one = 0x80, zero = 0;
    add(&one, 1);
    while (used_ != 56) add(&zero, 1);
    for (int shift = 56; shift >= 0; shift -= 8) {
      const uint8_t byte = static_cast<uint8_t>(bits >> shift);
      add(&byte, 1);
    }
    std::string text;
    for (uint32_t word : hash_) {
      char hex[9];
      std::snprintf(hex, sizeof hex, "%08x", word);
      text += hex;
    }
    return text;
  }

 private:
  static const Constants& constants() {
    static const Constants constants;
    return constants;
  }

  void mix() {
    used_ = 0;
    std::array<uint32_t, 64> w;
    for (size_t i = 0; i < 16; ++i) {
      w[i] = uint32_t{block_[4 * i]} << 24 | uint32_t{block_[4 * i + 1]} << 16 | uint32_t{block_[4 * i + 2]} << 8 | block_[4 * i + 3];
    }
    for (size_t i = 16; i < 64; ++i) {
      const uint32_t s0 = std::rotr(w[i - 15], 7) ^ std::rotr(w[i - 15], 18) ^ w[i - 15] >> 3;
      const uint32_t s1 = std::rotr(w[i - 2], 17) ^ std::rotr(w[i - 2], 19) ^ w[i - 2] >> 10;
      w[i] = w[i - 16] + s0 + w[i - 7] + s1;
    }
    auto [a, b, c, d, e, f, g, h] = hash_;
    for (size_t i = 0; i < 64; ++i) {
      const uint32_t s1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
      const uint32_t t1 = h + s1 + ((e & f) ^ (~e & g)) + constants().k[i] + w[i];
      const uint32_t s0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
      const uint32_t t2 = s0 + ((a & b) ^ (a & c) ^ (b & c));
      h = g, g = f, f = e, e = d + t1, d = c, c = b, b = a, a = t1 + t2;
    }
    const std::array<uint32_t, 8> mixed{a, b, c, d, e, f, g, h};
    for (size_t i = 0; i < 8; ++i) hash_[i] += mixed[i];
  }

  std::array<uint32_t, 8> hash_;
  std::array<uint8_t, 64> block_{};
  size_t used_ = 0;
  uint64_t total_ = 0;
};

}  // namespace

std::string sha256(const uint8_t* data, size_t size) {
  Sha256 hash;
  hash.add(data, size);
  return hash.digits();
}

std::string sha256_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return "";
  Sha256 hash;
  std::vector<char> buffer(1 << 16);
  while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size())), file.gcount() > 0) {
    hash.add(reinterpret_cast<const uint8_t*>(buffer.data()), static_cast<size_t>(file.gcount()));
  }
  return hash.digits();
}

}  // namespace ruedo::server
