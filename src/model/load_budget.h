// What reading a model may cost when anybody may have asked for it: time, and memory of its meshes.
//
// Who reads asks take_time() before what is long, and tells what it takes; anybody may leave_off().
// Thread safe.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace ruedo::model {

class LoadBudget {
 public:
  using Clock = std::chrono::steady_clock;

  LoadBudget(std::chrono::seconds time, size_t mesh_bytes)
      : time_(time), end_(Clock::now() + time), bytes_left_(mesh_bytes), bytes_(mesh_bytes) {}

  // Ends the reading as soon as it asks again.
  void leave_off() { left_off_ = true; }
  bool is_over() const { return left_off_ || Clock::now() > end_; }

  // These throw std::runtime_error when there is nothing left; the whole model is to be refused
  // then, by fault().
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

  // "": it was enough. The reader's.
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

}  // namespace ruedo::model
