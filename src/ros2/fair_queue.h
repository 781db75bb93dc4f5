// The requests to a service, in the order in which they are answered: round-robin over clients,
// each client's calls in order, at a limited rate. A client that calls without end delays nobody,
// and floods nobody with answers: each answer of a service goes to all its clients.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>

namespace ruedo::ros2 {

struct Pace {
  double per_second = 2000.0;
  double at_once = 100.0;
};

template <class Item>
class FairQueue {
 public:
  using Clock = std::chrono::steady_clock;

  explicit FairQueue(Pace pace = {}) : pace_(pace), credit_(pace.at_once) {}

  void push(uint64_t client, Item item) {
    waiting_[client].push_back(std::move(item));
    ++size_;
  }

  // The next request; none: nothing is waiting, or it has to wait longer. may: whether the client
  // whose turn it is may be answered.
  template <class May>
  std::optional<std::pair<uint64_t, Item>> next(Clock::time_point now, May may) {
    refill(now);
    if (credit_ < 1.0) return std::nullopt;
    for (size_t looked = 0; looked < waiting_.size(); ++looked) {
      auto own = waiting_.upper_bound(last_);
      if (own == waiting_.end()) own = waiting_.begin();
      last_ = own->first;
      if (!may(last_)) continue;
      credit_ -= 1.0;
      std::pair<uint64_t, Item> found{last_, std::move(own->second.front())};
      own->second.pop_front();
      if (own->second.empty()) waiting_.erase(own);
      --size_;
      return found;
    }
    return std::nullopt;
  }

  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

 private:
  void refill(Clock::time_point now) {
    const std::chrono::duration<double> passed = now - std::exchange(refilled_, now);
    credit_ = std::min(pace_.at_once, credit_ + passed.count() * pace_.per_second);
  }

  Pace pace_;
  std::map<uint64_t, std::deque<Item>> waiting_;  // by client; no empty entries
  size_t size_ = 0;
  uint64_t last_ = 0;  // who had the last turn
  double credit_;      // answers that may be given now
  Clock::time_point refilled_;
};

}  // namespace ruedo::ros2
