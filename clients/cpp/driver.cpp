// Driving: repetition of held commands, and what motion_status_t says of primitives.
#include "driver.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "core.h"
#include "ruedo/move_command_t.hpp"

namespace ruedo::client {
namespace {

// A primitive that no status has shown after this many statuses and this time was lost or replaced at once.
constexpr int kUnseenStatuses = 20;
constexpr auto kUnseenTime = std::chrono::seconds(1);

}  // namespace

void MotionCore::update(const MotionStatus& status) {
  std::lock_guard lock(mutex);
  if (done()) return;
  if (status.id == id) {
    progress = status.progress;
    remaining = status.remaining;
    state = status.state;
    reason = status.reason;
  } else if (status.state == "refused") {
    // another command, which changed nothing
  } else if (state != "sent" || (++unseen >= kUnseenStatuses && Clock::now() - sent >= kUnseenTime)) {
    state = "ended";    // its own end fell between two statuses
    reason = "replaced";
  }
  news.notify_all();
}

Driver::Driver(Core& core, std::string robot, double watchdog) : core_(core), robot_(std::move(robot)), watchdog_(watchdog) {}

void Driver::listen(const std::shared_ptr<StreamCore>& motion) {
  {
    std::lock_guard lock(mutex_);
    if (std::exchange(listening_, true)) return;
  }
  motion->on_sample([this](const Sample& sample) { on_status(static_cast<const MotionStatus&>(sample)); });
}

void Driver::hold(const std::string& channel, std::vector<uint8_t> bytes) {
  std::lock_guard lock(mutex_);
  held_channel_ = channel;
  held_ = std::move(bytes);
  running_ = false;
  core_.bus().publish(held_channel_, held_.data(), held_.size());
}

void Driver::repeat() {
  std::lock_guard lock(mutex_);
  if (!held_.empty()) core_.bus().publish(held_channel_, held_.data(), held_.size());
}

double Driver::period() const { return watchdog_ > 0.0 ? std::clamp(watchdog_ / 4.0, 0.01, 0.1) : 0.1; }

std::shared_ptr<MotionCore> Driver::move(const std::string& channel, const move_command_t& command, const std::string& kind) {
  auto motion = std::make_shared<MotionCore>();
  motion->connection = core_.weak_from_this();
  motion->robot = robot_;
  motion->kind = kind;
  motion->id = command.id;
  motion->remaining = std::abs(command.value);
  motion->sent = Clock::now();
  std::lock_guard lock(mutex_);
  held_.clear();    // a repetition after this would replace the primitive
  std::erase_if(motions_, [](const auto& other) {
    std::lock_guard other_lock(other->mutex);
    return other->done();
  });
  motions_.push_back(motion);
  core_.bus().publish(channel, command);
  return motion;
}

void Driver::on_status(const MotionStatus& status) {
  std::vector<std::shared_ptr<MotionCore>> motions;
  bool stopped = false;
  {
    std::lock_guard lock(mutex_);
    motions = motions_;
    running_ = running_ || (!held_.empty() && status.id == 0 && status.state == "running");
    stopped = running_ && !held_.empty() && status.reason == "watchdog" && !watchdog_told_;
    watchdog_told_ = watchdog_told_ || stopped;
  }
  if (stopped) {
    std::fprintf(stderr, "ruedo: %s: stopped by its watchdog: no command came for %g s of sim time\n", robot_.c_str(), watchdog_);
  }
  for (const auto& motion : motions) motion->update(status);
}

int64_t Motion::id() const { return core_->id; }
bool Motion::done() const {
  std::lock_guard lock(core_->mutex);
  return core_->done();
}
std::string Motion::state() const {
  std::lock_guard lock(core_->mutex);
  return core_->state;
}
std::string Motion::reason() const {
  std::lock_guard lock(core_->mutex);
  return core_->reason;
}
double Motion::progress() const {
  std::lock_guard lock(core_->mutex);
  return core_->progress;
}
double Motion::remaining() const {
  std::lock_guard lock(core_->mutex);
  return core_->remaining;
}

const Motion& Motion::wait(double timeout) const {
  const Clock::time_point deadline = deadline_after(timeout);
  MotionCore& motion = *core_;
  char text[64];
  std::unique_lock lock(motion.mutex);
  while (!motion.done()) {
    if (Clock::now() >= deadline) {
      std::snprintf(text, sizeof text, "%g s (%.3f remain)", timeout, motion.remaining);
      throw Timeout(motion.robot + ": " + motion.kind + " was not done within " + text);
    }
    motion.news.wait_until(lock, std::min(deadline, Clock::now() + std::chrono::milliseconds(500)));
    const auto connection = motion.connection.lock();
    if (!connection) throw NoServer("this simulation was closed");
    connection->check_server();
  }
  if (motion.state != "done") {
    std::snprintf(text, sizeof text, ", %.3f remain", motion.remaining);
    throw MotionError(motion.robot + ": " + motion.kind + (motion.state == "refused" ? " was refused: " : " ended: ") +
                          motion.reason + text, motion.reason);
  }
  return *this;
}

}  // namespace ruedo::client
