// Synchronisation between a simulation's threads: a bounded queue from one thread to another, and a
// flag that wakes a waiting thread. Mutexes exist only here, in the pacer and in the inboxes.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <vector>

namespace ruedo::engine {

// A queue of at most `capacity` values between two threads. Its memory is allocated once.
template <class Value>
class Queue {
 public:
  explicit Queue(size_t capacity) : values_(capacity) {}

  // Blocks while the queue is full.
  void push(Value value) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return size_ < values_.size(); });
      values_[(first_ + size_++) % values_.size()] = value;
    }
    changed_.notify_one();
  }

  // Blocks while the queue is empty.
  Value pop() {
    Value value;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return size_ > 0; });
      value = values_[first_];
      first_ = (first_ + 1) % values_.size();
      --size_;
    }
    changed_.notify_one();
    return value;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Value> values_;
  size_t first_ = 0, size_ = 0;
};

// Set from any thread, awaited by one. Setting it twice has the same effect as once.
class Wakeup {
 public:
  void set() {
    {
      std::lock_guard lock(mutex_);
      if (set_) return;
      set_ = true;
    }
    changed_.notify_one();
  }

  void wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return set_; });
    set_ = false;
  }

  // False on a timeout.
  bool wait_until(std::chrono::steady_clock::time_point time) {
    std::unique_lock lock(mutex_);
    const bool was_set = changed_.wait_until(lock, time, [&] { return set_; });
    set_ = false;
    return was_set;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool set_ = false;
};

}  // namespace ruedo::engine
