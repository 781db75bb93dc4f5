// Pictures as files have them: OpenCV's codecs, which are loaded with the first picture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>  // names of ways to read and write; its functions are not linked

namespace ruedo::model {

// As cv::imdecode: an empty picture, or cv::Exception, for what is none. `how` is cv::IMREAD_...
// These throw EnvironmentError where the codecs cannot be loaded.
cv::Mat decode_picture(const void* bytes, size_t size, int how);
// As cv::imencode: `kind` is ".png" or ".jpg".
void encode_picture(const std::string& kind, const cv::Mat& picture, std::vector<uint8_t>& bytes,
                    const std::vector<int>& parameters = {});

}  // namespace ruedo::model
