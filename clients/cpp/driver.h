// The commands of one robot: what is repeated until changed, and the motion primitives under way.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "ruedo/client.h"

namespace ruedo {
struct move_command_t;
}

namespace ruedo::client {

class Bus;

// A primitive under way.
struct MotionCore {
  std::weak_ptr<Core> connection;
  std::string robot, kind;
  int64_t id = 0;
  std::chrono::steady_clock::time_point sent;
  std::string channel;
  std::vector<uint8_t> message;

  std::mutex mutex;
  std::condition_variable news;
  MotionState state = MotionState::sent;
  MotionReason reason = MotionReason::none;
  std::string blocked_by;
  double progress = 0.0, remaining = 0.0;
  int unseen = 0;  // statuses that did not show it
  int64_t utime =
      -1;  // of the newest status; earlier ones are of another run, or of a coming reset
  int64_t shown = -1;                              // of the newest status that shows it
  std::chrono::steady_clock::time_point again_at;  // when to send it unless a status shows it
  std::chrono::steady_clock::duration again{};
  std::vector<std::thread::id> waiting;

  // With the mutex held.
  bool done() const {
    return state == MotionState::done || state == MotionState::ended ||
           state == MotionState::refused;
  }
  void await_end(std::unique_lock<std::mutex>& lock, Duration timeout);
  std::string remaining_text() const;

  // Without it.
  void update(const MotionStatus& status, const std::string& blocker);
  void end(MotionReason why);
  bool due_again(std::chrono::steady_clock::time_point now);  // it is to be sent now
};

// The connection has one for each robot that was driven.
class Driver : public std::enable_shared_from_this<Driver> {
 public:
  Driver(std::weak_ptr<Core> core, std::string robot, double watchdog);

  // Publishes the command now, and again until the next one.
  void keep_sending(Bus& bus, const std::string& channel, std::vector<uint8_t> bytes);
  // Repeats the held command, and the newest primitive until a status shows it, by real time.
  void repeat(Bus& bus);
  void repeat_at(int64_t utime, Bus& bus);  // the held command, by sim time
  double period() const;                    // s of real time between repetitions

  std::shared_ptr<MotionCore> move(Bus& bus, const std::string& channel,
                                   const move_command_t& command, const std::string& kind);
  // collisions may be null: a blocked motion then does not know by what. Throws UnknownName when
  // the robot is gone.
  void listen(const std::shared_ptr<StreamCore>& motion,
              const std::shared_ptr<StreamCore>& collisions);
  void begin_epoch();             // sim time was reset
  void end(MotionReason reason);  // its robot, or its run, is gone: nothing is repeated to the next
                                  // one of that name

 private:
  void on_status(const MotionStatus& status);

  const std::weak_ptr<Core> core_;
  const std::string robot_;
  const double watchdog_;  // s
  std::mutex listening_;   // the two that follow
  Subscription statuses_, collisions_;
  std::mutex mutex_;
  std::string held_channel_;
  std::vector<uint8_t> held_;  // empty: nothing
  int64_t held_at_ = 0;        // us, when it last went out by sim time
  std::vector<std::shared_ptr<MotionCore>> motions_;
  std::string blocked_by_;
  MotionReason ended_ = MotionReason::none;
  bool running_ = false, watchdog_told_ = false;
};

}  // namespace ruedo::client
