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

// A primitive is sent again until a status shows it: messages may be lost, and the server executes
// each once. One that no status has shown after so many statuses and this time is lost, or was
// replaced at once.
constexpr std::chrono::milliseconds kFirstAgain(100), kLastAgain(1000);
constexpr int kUnseenStatuses = 20;
constexpr auto kUnseenTime = std::chrono::seconds(5);

}  // namespace

void MotionCore::update(const MotionStatus& status, const std::string& blocker) {
  const std::lock_guard lock(mutex);
  const auto core = connection.lock();
  if (done() || !core || (status.utime < utime && !core->clock().is_far_ahead(utime))) return;
  utime = status.utime;
  if (status.id == id) {
    progress = status.progress;
    remaining = status.remaining;
    state = status.state;
    reason = status.reason;
    shown = status.utime;
    blocked_by = reason == MotionReason::blocked ? blocker : "";
  } else if (status.state == MotionState::refused) {
    // another command, which changed nothing
  } else if (status.state == MotionState::ended && status.utime == shown) {
    // what it ended itself: the network may exchange the two
  } else if (state != MotionState::sent) {
    state = MotionState::ended;  // its own end fell between two statuses
    reason = MotionReason::replaced;
  } else if (++unseen >= kUnseenStatuses && Clock::now() - sent >= kUnseenTime) {
    state = MotionState::ended;
    reason = MotionReason::lost;
  }
  if (done() && !waiting.empty()) core->progress().use(status.utime, waiting);
  news.notify_all();
}

bool MotionCore::due_again(Clock::time_point now) {
  const std::lock_guard lock(mutex);
  if (state != MotionState::sent || now < again_at) return false;
  again_at = now + again;
  again = std::min<Clock::duration>(2 * again, kLastAgain);
  return true;
}

void MotionCore::end(MotionReason why) {
  const std::lock_guard lock(mutex);
  if (done()) return;
  state = MotionState::ended;
  reason = why;
  news.notify_all();
}

Driver::Driver(std::weak_ptr<Core> core, std::string robot, double watchdog)
    : core_(std::move(core)), robot_(std::move(robot)), watchdog_(watchdog) {}

void Driver::listen(const std::shared_ptr<StreamCore>& motion,
                    const std::shared_ptr<StreamCore>& collisions) {
  {
    const std::lock_guard lock(mutex_);
    if (ended_ != MotionReason::none)
      throw UnknownName(robot_ +
                        " is gone: " + to_string(ended_));  // while the command was being made
  }
  const std::lock_guard lock(listening_);
  if (statuses_.open()) return;
  if (collisions) {  // of a step they come before the status
    collisions_ = collisions->on_arrival([self = weak_from_this()](const Sample& sample) {
      const auto driver = self.lock();
      if (!driver) return;
      const std::lock_guard driver_lock(driver->mutex_);
      driver->blocked_by_ = static_cast<const Collisions&>(sample).blocked_by;
    });
  }
  statuses_ = motion->on_arrival([self = weak_from_this()](const Sample& sample) {
    if (const auto driver = self.lock())
      driver->on_status(static_cast<const MotionStatus&>(sample));
  });
}

void Driver::keep_sending(Bus& bus, const std::string& channel, std::vector<uint8_t> bytes) {
  const std::lock_guard lock(mutex_);
  if (ended_ != MotionReason::none) return;
  held_channel_ = channel;
  held_ = std::move(bytes);
  running_ = false;
  bus.publish(held_channel_, held_.data(), held_.size());
}

void Driver::repeat(Bus& bus) {
  const std::lock_guard lock(mutex_);
  if (!held_.empty()) {
    bus.publish(held_channel_, held_.data(), held_.size());
  } else if (!motions_.empty() && motions_.back()->due_again(Clock::now())) {
    const MotionCore& newest = *motions_.back();
    bus.publish(newest.channel, newest.message.data(), newest.message.size());
  }
}

void Driver::repeat_at(int64_t utime, Bus& bus) {
  const std::lock_guard lock(mutex_);
  if (held_.empty()) return;
  const double since = static_cast<double>(utime) - static_cast<double>(held_at_);
  if (since >= 0.0 && since < 1e6 * period()) return;
  held_at_ = utime;
  bus.publish(held_channel_, held_.data(), held_.size());
}

double Driver::period() const {
  return watchdog_ > 0.0 ? std::clamp(watchdog_ / 4.0, 0.01, 0.1) : 0.1;
}

std::shared_ptr<MotionCore> Driver::move(Bus& bus, const std::string& channel,
                                         const move_command_t& command, const std::string& kind) {
  auto motion = std::make_shared<MotionCore>();
  motion->connection = core_;
  motion->robot = robot_;
  motion->kind = kind;
  motion->id = command.id;
  motion->remaining = std::abs(command.value);
  motion->channel = channel;
  motion->message = encoded(command);
  motion->sent = Clock::now();
  motion->again_at = motion->sent + kFirstAgain;
  motion->again = 2 * kFirstAgain;
  const std::lock_guard lock(mutex_);
  held_.clear();  // a repetition after this would replace the primitive
  motions_.erase(std::remove_if(motions_.begin(), motions_.end(),
                                [](const auto& other) {
                                  const std::lock_guard other_lock(other->mutex);
                                  return other->done();
                                }),
                 motions_.end());
  motions_.push_back(motion);
  if (ended_ != MotionReason::none) motion->end(ended_);
  bus.publish(channel, motion->message.data(), motion->message.size());
  return motion;
}

void Driver::begin_epoch() {
  const std::lock_guard lock(mutex_);
  for (const auto& motion : motions_) {
    const std::lock_guard motion_lock(motion->mutex);
    motion->utime = motion->shown = -1;
  }
}

void Driver::end(MotionReason reason) {
  std::vector<std::shared_ptr<MotionCore>> motions;
  {
    const std::lock_guard lock(mutex_);
    ended_ = reason;
    held_.clear();
    motions = std::move(motions_);
    motions_.clear();
  }
  Subscription statuses, collisions;
  {
    const std::lock_guard lock(listening_);
    statuses = std::move(statuses_);
    collisions = std::move(collisions_);
  }
  for (const auto& motion : motions) motion->end(reason);
}

void Driver::on_status(const MotionStatus& status) {
  std::vector<std::shared_ptr<MotionCore>> motions;
  std::string blocker;
  bool stopped = false;
  {
    const std::lock_guard lock(mutex_);
    motions = motions_;
    blocker = blocked_by_;
    running_ =
        running_ || (!held_.empty() && status.id == 0 && status.state == MotionState::running);
    stopped =
        running_ && !held_.empty() && status.reason == MotionReason::watchdog && !watchdog_told_;
    watchdog_told_ = watchdog_told_ || stopped;
  }
  if (stopped) {
    std::fprintf(stderr,
                 "ruedo: %s: stopped by its watchdog: no command came for %g s of sim time\n",
                 robot_.c_str(), watchdog_);
  }
  for (const auto& motion : motions) motion->update(status, blocker);
}

int64_t Motion::id() const { return core_->id; }
bool Motion::done() const {
  std::lock_guard lock(core_->mutex);
  return core_->done();
}
MotionState Motion::state() const {
  std::lock_guard lock(core_->mutex);
  return core_->state;
}
MotionReason Motion::reason() const {
  std::lock_guard lock(core_->mutex);
  return core_->reason;
}
std::string Motion::blocked_by() const {
  std::lock_guard lock(core_->mutex);
  return core_->blocked_by;
}
double Motion::progress() const {
  std::lock_guard lock(core_->mutex);
  return core_->progress;
}
double Motion::remaining() const {
  std::lock_guard lock(core_->mutex);
  return core_->remaining;
}

std::string MotionCore::remaining_text() const {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f remain", remaining);
  return text;
}

void MotionCore::await_end(std::unique_lock<std::mutex>& lock, Duration timeout) {
  const Clock::time_point deadline = deadline_after(timeout);
  const auto me = std::this_thread::get_id();
  waiting.push_back(me);
  struct Leave {
    MotionCore& motion;
    const std::thread::id me;
    ~Leave() { motion.waiting.erase(std::find(motion.waiting.begin(), motion.waiting.end(), me)); }
  };
  const Leave leave{*this, me};
  const auto core = connection.lock();
  if (!core && !done()) throw NoServer(kClosed);
  if (!core) return;
  core->check_callbacks();
  Standstill standstill = core->standstill(robot + ": wait() for " + kind);
  while (!done()) {
    if (Clock::now() >= deadline) {
      const std::string why = standstill.reason();
      throw Timeout(robot + ": " + kind + " was not done within " + text_of(timeout) + " s (" +
                    remaining_text() + (why.empty() ? "" : "; " + why) + ")");
    }
    core->check_may_wait();
    core->progress().wait();
    news.wait_until(lock, std::min(deadline, Clock::now() + std::chrono::milliseconds(500)));
    if (done()) break;
    core->check_server();
    if (deadline == Clock::time_point::max()) standstill.look();
  }
  core->begin_after(utime);
}

const Motion& Motion::wait(Duration timeout) const {
  MotionCore& motion = *core_;
  std::unique_lock lock(motion.mutex);
  motion.await_end(lock, timeout);
  if (motion.state != MotionState::done) {
    throw MotionError(motion.robot + ": " + motion.kind +
                          (motion.state == MotionState::refused ? " was refused: " : " ended: ") +
                          to_string(motion.reason) +
                          (motion.blocked_by.empty() ? "" : " by " + motion.blocked_by) + ", " +
                          motion.remaining_text(),
                      motion.reason);
  }
  return *this;
}

}  // namespace ruedo::client
