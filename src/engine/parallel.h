// A parallel loop over pieces, with TBB.
//
// TBB is not instrumented for the thread sanitizer, which would report every body as a race. Builds
// with that sanitizer run the bodies in plain threads, so that real races between them are found.
#pragma once

#if defined(__SANITIZE_THREAD__)
#include <atomic>
#include <thread>
#else
#include <tbb/parallel_for.h>
#endif

namespace ruedo::engine {

// Calls body(0), ..., body(count - 1), in any order and from any threads, and returns when all are
// done.
template <class Body>
void parallel_pieces(int count, const Body& body) {
#if defined(__SANITIZE_THREAD__)
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int piece = next++; piece < count; piece = next++) body(piece);
  };
  std::thread helper(work);
  work();
  helper.join();
#else
  tbb::parallel_for(0, count, body);
#endif
}

}  // namespace ruedo::engine
