// The size of a picture, from its header: decoders allocate before they look at the data, and a
// file of a few kilobytes can demand gigabytes.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace ruedo::world {

// The error in the size; "" for a picture of at most `most` pixels in width and height and
// kMostPixelsInAll. Supports PNG, JPEG, BMP, TIFF, PBM, PGM and PPM; everything else is not a
// picture.
std::string picture_fault(std::span<const uint8_t> bytes, int64_t most);

// Width times height; 0 if it is not a picture, or has more than kMostPixelsInAll, which are not
// decoded.
int64_t picture_pixels(std::span<const uint8_t> bytes);

inline int64_t picture_pixels(const std::string& bytes) {
  return picture_pixels({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()});
}
inline std::string picture_fault(const std::string& bytes, int64_t most) {
  return picture_fault({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()}, most);
}

}  // namespace ruedo::world
