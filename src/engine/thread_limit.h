// How many threads work inside of the modules. It changes no result, only how fast it comes.
#pragma once

#include <memory>

namespace ruedo::engine {

// Holds while it lives. 0: one thread a core.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ruedo::engine
