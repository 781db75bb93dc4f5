// Pictures as ROS wants them: raw pixels, or JPEG.
#pragma once

#include <cstdint>
#include <vector>

#include "ruedo/image_t.hpp"

namespace ruedo::ros2 {

struct RawPicture {
  uint32_t width = 0, height = 0, step = 0;  // step: bytes in a row
  const char* encoding = "rgb8";             // sensor_msgs/image_encodings.hpp
  std::vector<uint8_t> data;
};

// A JPEG picture is decoded; one that is damaged is empty.
RawPicture raw_picture(const image_t& image);

// Of raw pixels in grey or colour; empty for anything else.
std::vector<uint8_t> jpeg_of(const image_t& image);

}  // namespace ruedo::ros2
