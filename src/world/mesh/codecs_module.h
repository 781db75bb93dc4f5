// The functions of libruedo_codecs.so (world/mesh/codecs.h), with C linkage.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

extern "C" {
void ruedo_decode_picture(const void* bytes, size_t size, int how, cv::Mat& picture);
void ruedo_encode_picture(const std::string& kind, const cv::Mat& picture,
                          std::vector<uint8_t>& bytes, const std::vector<int>& parameters);
}
