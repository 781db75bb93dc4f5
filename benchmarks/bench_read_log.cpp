// Reads each pose of a log's channel by the C++ client, in constant memory.
//
//   bench_read_log LOG CHANNEL
#include <cstdio>

#include "ruedo/client.h"

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: %s LOG CHANNEL\n", argv[0]), 2;
  double x = 0;
  size_t count = 0;
  ruedo::client::read_log(argv[1]).each<ruedo::client::Pose>(
      argv[2], [&](const ruedo::client::Pose& pose) { x += pose.position[0], ++count; });
  std::printf("%zu poses, mean x %g m\n", count, x / static_cast<double>(count));
}
