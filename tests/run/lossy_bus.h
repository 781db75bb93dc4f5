// A bus that loses, duplicates and reorders messages, independently for each direction and
// listener, by a seeded generator.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "running.h"

namespace ruedo::run {

struct Faults {
  double loss = 0.0, twice = 0.0,
         late = 0.0;  // probabilities; a late message comes after the next one
};

// One direction to one listener.
class LossyLink {
 public:
  LossyLink(Faults faults, unsigned seed) : faults_(faults), random_(seed) {}

  // Calls deliver for each message that arrives now.
  template <class Deliver>
  void pass(const Message& message, Deliver&& deliver) {
    std::optional<Message> before = std::move(late_);
    late_.reset();
    if (draw() < faults_.loss) {
      ++lost_;
    } else if (draw() < faults_.late) {
      late_ = message;
    } else {
      deliver(message);
      if (draw() < faults_.twice) deliver(message);
    }
    if (before) deliver(*before);
  }
  size_t lost() const { return lost_; }

 private:
  double draw() { return static_cast<double>(random_() >> 8) / static_cast<double>(1u << 24); }
  Faults faults_;
  std::minstd_rand random_;
  std::optional<Message> late_;
  size_t lost_ = 0;
};

class LossyBus : public Bus {
 public:
  LossyBus(Faults faults, unsigned seed) : faults_(faults), to_server_(faults, seed), seed_(seed) {}

  class Listener {  // a client's end
   public:
    Listener(Faults faults, unsigned seed) : link_(faults, seed) {}
    std::optional<Message> receive(std::chrono::milliseconds timeout) {
      std::unique_lock lock(mutex_);
      if (!news_.wait_for(lock, timeout, [&] { return !queue_.empty(); })) return std::nullopt;
      Message message = std::move(queue_.front());
      queue_.pop_front();
      return message;
    }

   private:
    friend class LossyBus;
    std::mutex mutex_;
    std::condition_variable news_;
    LossyLink link_;
    std::deque<Message> queue_;
  };

  std::shared_ptr<Listener> connect() {
    std::lock_guard lock(mutex_);
    listeners_.push_back(std::make_shared<Listener>(faults_, ++seed_));
    return listeners_.back();
  }

  void publish(const std::string& channel, const uint8_t* data, size_t size) override {
    if (channel == "ruedo/reply") std::this_thread::sleep_for(hold_.exchange({}));
    const Message message{channel, {data, data + size}};
    std::lock_guard lock(mutex_);
    for (const auto& listener : listeners_) {
      std::lock_guard listener_lock(listener->mutex_);
      listener->link_.pass(message,
                           [&](const Message& arrived) { listener->queue_.push_back(arrived); });
      listener->news_.notify_one();
    }
  }

  void listen(const std::vector<std::string>&, Handler handler,
              const std::vector<std::string>&) override {
    std::lock_guard lock(sending_);
    handler_ = std::move(handler);
  }

  void send(const std::string& channel, const std::vector<uint8_t>& bytes) {
    std::lock_guard lock(sending_);
    if (!handler_) return;  // without a listener: lost
    to_server_.pass({channel, bytes}, [&](const Message& arrived) {
      handler_(arrived.channel, arrived.bytes.data(), arrived.bytes.size());
    });
  }

  void stop() override {
    std::lock_guard lock(sending_);
    handler_ = nullptr;
  }
  // The next reply is delayed, and the server with it.
  void hold_next(std::chrono::milliseconds time) { hold_ = time; }
  size_t lost_to_server() {
    std::lock_guard lock(sending_);
    return to_server_.lost();
  }

 private:
  Faults faults_;
  std::atomic<std::chrono::milliseconds> hold_{};
  std::mutex sending_;
  LossyLink to_server_;
  Handler handler_;
  std::mutex mutex_;
  unsigned seed_;
  std::vector<std::shared_ptr<Listener>> listeners_;
};

}  // namespace ruedo::run
