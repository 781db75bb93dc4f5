#include "system/enough_threads.h"

#include <algorithm>
#include <latch>
#include <thread>
#include <vector>

namespace ruedo {

void require_threads(int count) {
  std::latch all(1);
  std::vector<std::jthread> threads;
  try {
    for (int i = 0; i < count; ++i) threads.emplace_back([&] { all.wait(); });
  } catch (...) {
    all.count_down();
    throw;
  }
  all.count_down();
}

void require_threads_for_cores(int more) {
  require_threads(static_cast<int>(std::max(std::thread::hardware_concurrency(), 1u)) + more);
}

}  // namespace ruedo
