// How many threads work inside the modules. Affects only the speed, never a result.
#pragma once

#include <memory>

namespace ruedo::engine {

// Applies while it lives. 0: one thread per core.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ruedo::engine
