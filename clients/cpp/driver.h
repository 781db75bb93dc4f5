// The commands of one robot: what is repeated until changed, and the motion primitives under way.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "ruedo/client.h"

namespace ruedo {
struct move_command_t;
}

namespace ruedo::client {

// A primitive under way.
struct MotionCore {
  std::weak_ptr<Core> connection;
  std::string robot, kind;
  int64_t id = 0;
  std::chrono::steady_clock::time_point sent;

  std::mutex mutex;
  std::condition_variable news;
  std::string state = "sent", reason;
  double progress = 0.0, remaining = 0.0;
  int unseen = 0;    // statuses that did not show it

  bool done() const { return state == "done" || state == "ended" || state == "refused"; }    // with the mutex held
  void update(const MotionStatus& status);
};

class Driver {
 public:
  Driver(Core& core, std::string robot, double watchdog);

  // Publishes the command now, and again until the next one.
  void hold(const std::string& channel, std::vector<uint8_t> bytes);
  void repeat();
  double period() const;    // s of real time between repetitions

  std::shared_ptr<MotionCore> move(const std::string& channel, const move_command_t& command, const std::string& kind);
  void listen(const std::shared_ptr<StreamCore>& motion);

 private:
  void on_status(const MotionStatus& status);

  Core& core_;
  const std::string robot_;
  const double watchdog_;    // s
  std::mutex mutex_;
  std::string held_channel_;
  std::vector<uint8_t> held_;    // empty: nothing
  std::vector<std::shared_ptr<MotionCore>> motions_;
  bool listening_ = false, running_ = false, watchdog_told_ = false;
};

}  // namespace ruedo::client
