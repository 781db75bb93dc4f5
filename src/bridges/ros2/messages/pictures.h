// Pictures for ROS: raw pixels, or JPEG.
#pragma once

#include <cstdint>
#include <vector>

#include "ruedo/image_t.hpp"

namespace ruedo::ros2 {

struct RawPicture {
  uint32_t width = 0, height = 0, step = 0;  // step: bytes per row
  const char* encoding = "rgb8";             // sensor_msgs/image_encodings.hpp
  std::vector<uint8_t> data;
};

// Decodes a JPEG picture; empty if it is damaged.
RawPicture raw_picture(const image_t& image);

// Encodes raw grey or colour pixels; empty for anything else.
std::vector<uint8_t> jpeg_of(const image_t& image);

}  // namespace ruedo::ros2
