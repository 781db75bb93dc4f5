// TBB's limit, behind a name of our own.
#include "engine/thread_limit.h"

#include <tbb/global_control.h>

namespace ruedo::engine {

struct ThreadLimit::Impl {
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int threads) {
  if (threads <= 0) return;
  impl_.reset(new Impl{tbb::global_control(tbb::global_control::max_allowed_parallelism,
                                           static_cast<size_t>(threads))});
}

ThreadLimit::~ThreadLimit() = default;

}  // namespace ruedo::engine
