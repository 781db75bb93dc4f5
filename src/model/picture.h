// The size of a picture, from its header: decoders allocate before they look at the data, and a
// file of a few kilobytes can demand gigabytes.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace ruedo::model {

// What is wrong with the size; "" for a picture of at most `most` pixels in width and height and
// kMostPixelsInAll. Supports PNG, JPEG, BMP, TIFF, PBM, PGM and PPM; everything else is not a
// picture.
std::string picture_fault(std::span<const uint8_t> bytes, int64_t most);

inline std::string picture_fault(const std::string& bytes, int64_t most) {
  return picture_fault({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()}, most);
}

}  // namespace ruedo::model
