// libruedo_codecs.so, the only library that links OpenCV's codecs and the hundred libraries they
// need.
#include "world/mesh/codecs_module.h"

#include <opencv2/imgcodecs.hpp>

void ruedo_decode_picture(const void* bytes, size_t size, int how, cv::Mat& picture) {
  const cv::Mat packed(1, static_cast<int>(size), CV_8U, const_cast<void*>(bytes));
  picture = cv::imdecode(packed, how);
}

void ruedo_encode_picture(const std::string& kind, const cv::Mat& picture,
                          std::vector<uint8_t>& bytes, const std::vector<int>& parameters) {
  cv::imencode(kind, picture, bytes, parameters);
}
