// The largest picture that a camera takes, and with it the largest message of a run. Nothing beyond
// it is sent or recorded, so that a log in which a message is longer is damaged.
#pragma once

#include <cstddef>

namespace ruedo {

// Width and height of a picture, in pixels, at most.
inline constexpr int kMostPixels = 8192;
// Bytes of a message, at most: such a picture of four bytes a pixel, and what describes it.
inline constexpr size_t kLargestMessage = size_t{kMostPixels} * kMostPixels * 4 + 65536;

}  // namespace ruedo
