// The count of forks.
#include "forked.h"

#include <pthread.h>

#include <atomic>

namespace ruedo::client {
namespace {

std::atomic<int> forks{0};

}  // namespace

int fork_count() {
  static const int registered = pthread_atfork(nullptr, nullptr, [] { ++forks; });
  return static_cast<void>(registered), forks.load(std::memory_order_relaxed);
}

}  // namespace ruedo::client
