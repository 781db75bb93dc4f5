// The budget for loading a model from an untrusted source: time, and memory for its meshes.
//
// The reader calls take_time() before long operations, and reports the memory it uses; any caller
// may call leave_off(). Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace ruedo::world {

class LoadBudget {
 public:
  using Clock = std::chrono::steady_clock;

  LoadBudget(std::chrono::seconds time, size_t mesh_bytes)
      : time_(time), end_(Clock::now() + time), bytes_left_(mesh_bytes), bytes_(mesh_bytes) {}

  // Makes the reader stop when it asks next.
  void leave_off() { left_off_ = true; }
  bool is_over() const { return left_off_ || Clock::now() > end_; }

  // These throw std::runtime_error when nothing is left; the whole model must then be refused, with
  // fault().
  void take_time() {
    if (is_over())
      fail(left_off_ ? "the run ended"
                     : "it took longer than " + std::to_string(time_.count()) + " s");
  }
  void take_mesh(size_t bytes) {
    if (bytes > bytes_left_)
      fail("its meshes take more than " + std::to_string(bytes_ >> 20) + " MiB of memory");
    bytes_left_ -= bytes;
  }

  // "": the budget sufficed. For the reader's thread.
  const std::string& fault() const { return fault_; }

 private:
  [[noreturn]] void fail(const std::string& why) {
    if (fault_.empty()) fault_ = why;
    throw std::runtime_error(fault_);
  }

  const std::chrono::seconds time_;
  const Clock::time_point end_;
  std::atomic<bool> left_off_{false};
  size_t bytes_left_;
  const size_t bytes_;
  std::string fault_;
};

}  // namespace ruedo::world
