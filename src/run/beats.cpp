// All beats come from the last state that was published.
#include "run/beats.h"

#include <spdlog/spdlog.h>

#include "engine/world_state.h"
#include "ruedo/motion_status_t.hpp"
#include "run/journal.h"

namespace ruedo::run {

bool Beat::due(int64_t step) {
  if (step != last_ + 1 || step > next_) next_ = clock_.step_of(clock_.samples_before(step));
  last_ = step;
  return step == next_;
}

void Ticks::begin_step(const Step& step) {
  due_ = beat_.due(step.step) || wanted_(step.step);
  if (due_) tick_.begin(step.time_us, run_id_, step.epoch, step.step);
}

void Ticks::message(const Published& message) {
  if (due_) tick_.add_message(message.index, message.sequence, message.data, message.size);
}

void Ticks::say() {
  if (!publisher_.latest()) return;
  tick_.begin(publisher_.time_us(), run_id_, publisher_.epoch(), publisher_.step());
  finish();
}

void Ticks::end_step(const Step&) {
  if (due_) finish();
}

void Ticks::finish() {
  add_applied_(tick_, publisher_.step());
  tick_.finish(engine::state_hash(*publisher_.latest()), [this](const tick_t& part) {
    publisher_.service(publisher_.announcement().own.tick, part, part.part);
  });
  last_ = std::chrono::steady_clock::now();
  told_us_ = publisher_.time_us();
}

void InfoBeat::say() {
  const bool paused = paused_();
  for (world_info_t& part : info_) {
    part.utime = publisher_.time_us();
    part.paused = paused;
    publisher_.service(publisher_.announcement().own.info, part);
  }
  last_ = std::chrono::steady_clock::now();
}

state_hash_t HashBeat::now() const {
  state_hash_t hash;
  hash.utime = publisher_.time_us();
  hash.step = publisher_.step();
  hash.epoch = publisher_.epoch();
  hash.state_hash = publisher_.latest() ? engine::state_hash(*publisher_.latest())
                                        : 0;  // a run may end before its first state
  hash.last = false;
  return hash;
}

state_hash_t HashBeat::at_end() const {
  state_hash_t hash = now();
  hash.last = true;
  return hash;
}

void HashBeat::end_step(const Step& step) {
  if (beat_.due(step.step) && publisher_.has_recorders())
    publisher_.record(kStateHashChannel, now());
}

void WatchdogWarnings::end_step(const Step& step) {
  if (!beat_.due(step.step)) return;
  const IndexedVector<RobotIndex, RobotState>& robots = publisher_.latest()->robots;
  for (size_t i = 0; i < robots.size(); ++i) {
    const RobotIndex index(i);
    if (robots[index].motion.reason != motion_status_t::REASON_WATCHDOG) continue;
    const world::ModelInstance& robot = robot_(index);
    if (!told_.insert(robot.name).second) continue;
    const double watchdog_s = static_cast<double>(robot.model->drive->watchdog_us) * 1e-6;
    spdlog::warn(
        "{0} was stopped by its watchdog: no command came for {1:g} s of sim time. Send velocity "
        "and wheel commands at least every {1:g} s (shown once per robot)",
        robot.name, watchdog_s);
  }
}

}  // namespace ruedo::run
