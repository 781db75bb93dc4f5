// JPEG pictures that fit into one datagram.
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace ruedo {

constexpr int kLeastJpegQuality = 10;

// Encodes a picture (grey, or in OpenCV's colour order) with the requested quality, or with the
// highest lower one, in steps of 8, at which it fits into one datagram with LCM's header. The
// result depends on this picture alone.
void encode_jpeg(const cv::Mat& picture, int quality, std::vector<uint8_t>& bytes);

}  // namespace ruedo
