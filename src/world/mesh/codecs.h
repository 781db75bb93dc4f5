// Encoding and decoding of picture files, by OpenCV's codecs, which are loaded when first used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>  // for its constants; its functions are not linked

namespace ruedo::world {

// As cv::imdecode: an empty picture, or cv::Exception, for bytes that are not a picture. `how` is
// cv::IMREAD_...
// These throw EnvironmentError where the codecs cannot be loaded.
cv::Mat decode_picture(const void* bytes, size_t size, int how);
// As cv::imencode: `kind` is ".png" or ".jpg".
void encode_picture(const std::string& kind, const cv::Mat& picture, std::vector<uint8_t>& bytes,
                    const std::vector<int>& parameters = {});

}  // namespace ruedo::world
