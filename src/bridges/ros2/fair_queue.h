// The requests to a service, in the order in which they are answered: round-robin over clients,
// each client's calls in order, at a limited rate. A client that calls without end delays no
// other, and floods none with answers: each answer of a service goes to all clients, and one that
// has too little of a processor for them loses its own among them.
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
  double per_second = 0.0, at_once = 0.0;
};
inline constexpr Pace kOfAll{2000.0, 100.0};
// Of the clients that have more than so many calls waiting.
inline constexpr Pace kOfCrowds{200.0, 100.0};
inline constexpr size_t kCrowd = 50;

template <class Item>
class FairQueue {
 public:
  using Clock = std::chrono::steady_clock;

  explicit FairQueue(Pace of_all = kOfAll, Pace of_crowds = kOfCrowds)
      : all_(of_all), crowds_(of_crowds) {}

  void push(uint64_t client, Item item) {
    waiting_[client].push_back(std::move(item));
    ++size_;
  }

  // The next request; none: nothing is waiting, or it has to wait longer. may: whether the client
  // whose turn it is may be answered.
  template <class May>
  std::optional<std::pair<uint64_t, Item>> next(Clock::time_point now, May may) {
    const std::chrono::duration<double> passed = now - std::exchange(refilled_, now);
    all_.refill(passed.count());
    crowds_.refill(passed.count());
    if (all_.left < 1.0) return std::nullopt;
    for (size_t looked = 0; looked < waiting_.size(); ++looked) {
      auto own = waiting_.upper_bound(last_);
      if (own == waiting_.end()) own = waiting_.begin();
      last_ = own->first;
      const bool crowd = own->second.size() > kCrowd;
      if ((crowd && crowds_.left < 1.0) || !may(last_)) continue;
      all_.left -= 1.0;
      if (crowd) crowds_.left -= 1.0;
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
  struct Credit {
    explicit Credit(Pace of) : pace(of), left(of.at_once) {}
    void refill(double seconds) { left = std::min(pace.at_once, left + seconds * pace.per_second); }

    Pace pace;
    double left;  // answers that may be given now
  };

  Credit all_, crowds_;
  std::map<uint64_t, std::deque<Item>> waiting_;  // by client; no empty entries
  size_t size_ = 0;
  uint64_t last_ = 0;  // the client of the last turn
  Clock::time_point refilled_;
};

}  // namespace ruedo::ros2
