// Pictures as JPEG that fit one datagram.
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace ruedo {

constexpr int kLeastJpegQuality = 10;

// Encodes a picture (grey, or in OpenCV's order of colours) with the wanted quality, or with the
// best one below it, in steps of 8, at which it fits one datagram with room for LCM's head. What
// comes out depends on this picture alone, not on those before it.
void encode_jpeg(const cv::Mat& picture, int quality, std::vector<uint8_t>& bytes);

}  // namespace ruedo
