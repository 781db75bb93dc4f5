// Few pictures need more than one attempt: otherwise a bisection.
#include "sensors/jpeg.h"

#include <algorithm>

#include "world/mesh/codecs.h"

namespace ruedo {
namespace {

constexpr size_t kMaxMessage = 60000;
constexpr int kStep = 8;

}  // namespace

void encode_jpeg(const cv::Mat& picture, int quality, std::vector<uint8_t>& bytes) {
  int tried = 0;  // steps below the requested quality
  const auto fits = [&](int steps) {
    tried = steps;
    world::encode_picture(
        ".jpg", picture, bytes,
        {cv::IMWRITE_JPEG_QUALITY, std::max(quality - steps * kStep, kLeastJpegQuality)});
    return bytes.size() <= kMaxMessage;
  };
  if (fits(0)) return;
  int too_few = 0, enough = (quality - kLeastJpegQuality + kStep - 1) / kStep;
  while (enough - too_few > 1) {
    const int middle = (too_few + enough) / 2;
    (fits(middle) ? enough : too_few) = middle;
  }
  if (tried != enough) fits(enough);  // the lowest quality is used whether it fits or not
}

}  // namespace ruedo
