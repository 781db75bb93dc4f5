// How large a picture is, from its head: decoders allocate before they know what is in it, and a
// file of a few kilobytes can ask for gigabytes.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace ruedo::model {

// What is wrong with the size, in words; "" for a picture of at most `most` pixels each way and
// kMostPixelsInAll. Known are PNG, JPEG, BMP, TIFF and PBM, PGM, PPM; what is of another kind is no
// picture.
std::string picture_fault(std::span<const uint8_t> bytes, int64_t most);

inline std::string picture_fault(const std::string& bytes, int64_t most) {
  return picture_fault({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()}, most);
}

}  // namespace ruedo::model
