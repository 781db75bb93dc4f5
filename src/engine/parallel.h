// A parallel loop over pieces, with TBB.
//
// No exception leaves a body: TBB would cancel the loop's other bodies, with what they build in
// parallel themselves (Embree's trees), and does not survive that. Each body is called; then the
// exception of the first piece that threw is rethrown.
//
// TBB is not instrumented for the thread sanitizer, which would report every body as a race. Builds
// with that sanitizer run the bodies in plain threads, so that real races between them are found.
#pragma once

#include <exception>
#include <limits>
#include <mutex>

#if defined(__SANITIZE_THREAD__)
#include <atomic>
#include <thread>
#else
#include <tbb/parallel_for.h>
#endif

namespace ruedo::engine {

// Of several pieces, what the first in their order threw.
class FirstFailure {
 public:
  template <class Body>
  void call(const Body& body, int piece) noexcept {
    try {
      body(piece);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (piece >= piece_) return;
      piece_ = piece;
      failure_ = std::current_exception();
    }
  }
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  std::mutex mutex_;
  int piece_ = std::numeric_limits<int>::max();
  std::exception_ptr failure_;
};

// Calls body(0), ..., body(count - 1), in any order and from any threads, and returns when all are
// done. Throws what the first of them threw.
template <class Body>
void parallel_pieces(int count, const Body& body) {
  FirstFailure failure;
#if defined(__SANITIZE_THREAD__)
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int piece = next++; piece < count; piece = next++) failure.call(body, piece);
  };
  std::thread helper(work);
  work();
  helper.join();
#else
  tbb::parallel_for(0, count, [&](int piece) { failure.call(body, piece); });
#endif
  failure.rethrow();
}

}  // namespace ruedo::engine
