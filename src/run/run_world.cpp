// The world of each epoch, and the change from repeating a log to going on.
#include <algorithm>
#include <limits>

#include <spdlog/spdlog.h>

#include "base/version.h"
#include "engine/command_check.h"
#include "engine/world_state.h"
#include "ruedo/errors.h"
#include "run/run.h"

namespace ruedo::run {

// Makes everything that has a state. A repetition runs as fast as possible, whatever rate the
// clients set.
void Run::make_world() {
  if (!repeating_ && pacer_) wanted_ = {pacer_->rate(), pacer_->paused()};
  const Pace pace = repeating_ ? Pace{std::numeric_limits<double>::infinity(), false} : wanted_;
  {
    const std::lock_guard lock(simulation_mutex_);
    make_simulation(pace);
  }
  announce();  // the bus may have to wait for a thread that waits for the lock
}

void Run::make_simulation(const Pace& pace) {
  simulation_.reset();
  world_ = first_world_;
  if (edited_) edited_->begin();
  as_made_ = true;
  channels_.clear();
  own_ = engine::add_simulation_channels(channels_, options_.control);
  if (own_.request.valid() && request_channel_.empty())
    request_channel_ = channels_[own_.request].bus_name;  // once: other threads read it
  options_.simulation.fleet.epoch = epoch_;
  findings_ = Findings();
  simulation_ = std::make_unique<engine::Simulation>(world_, options_.simulation, channels_,
                                                     findings_, wakeup_);
  note_error(findings_.list());
  const int64_t last_step = options_.duration_us < 0 ? std::numeric_limits<int64_t>::max()
                                                     : options_.duration_us / world_->step_us;
  pacer_ = std::make_unique<Pacer>(world_->step_us, pace.rate, last_step);
  if (pace.paused) pacer_->pause();
  publisher_.begin_epoch(epoch_);
  begin_mode(mode(), -1);
}

void Run::note_error(const std::vector<Finding>& findings) {
  const auto error = std::find_if(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.kind == Finding::Kind::error;
  });
  if (!first_error_ && error != findings.end()) first_error_ = *error;
}

void Run::begin_mode(Mode& mode, int64_t step) {
  mode.begin(stage(), step);
  backpressure_.begin(epoch_, std::max<int64_t>(step, 0) * world_->step_us);
  limit_pace();
}

void Run::note_progress(const LauncherProgress& progress) {
  if (mode_->takes_grants()) return;  // they say how far the run goes
  const std::lock_guard lock(simulation_mutex_);
  if (!backpressure_.acts()) bus_.keep_all_for_launcher();
  backpressure_.note_progress(progress);
  limit_pace();
  wakeup_.set();  // the publisher continues, or wakes the thread that does
}

void Run::follow_nobody() {
  const std::lock_guard lock(simulation_mutex_);
  backpressure_.end();
  limit_pace();
  pacer_->look_again();
  wakeup_.set();
}

// A repetition is not published, and no client needs to follow it.
void Run::limit_pace() {
  pacer_->set_limits(repeating_ ? Backpressure::Limits{} : backpressure_.limits());
}

void Run::begin_epoch() {
  header_.epoch = ++epoch_;
  header_.seed = static_cast<int64_t>(options_.simulation.fleet.seed);
  make_world();
  if (journal_) journal_->begin(header_, publisher_.base_us());
  simulation_->start(*pacer_);
}

void Run::announce() {
  world_info_t head;
  head.utime = 0;
  head.run_id = run_id_;
  head.epoch = epoch_;
  head.version = version();
  head.world = world_->name;
  head.seed = static_cast<int64_t>(options_.simulation.fleet.seed);
  head.step_us = world_->step_us;
  head.features = options_.control ? features() : 0;
  head.paused = pacer_->paused();
  publisher_.announce({channels_, own_,
                       engine::make_world_info(head, *world_, simulation_->layout(),
                                               simulation_->devices(), channels_)});
  tell_readers();
}

Mode::Stage Run::stage() {
  return {&simulation_->inbox(),
          pacer_.get(),
          &channels_,
          publisher_.base_us(),
          [this](RobotIndex robot) { return instance_of(robot).name; },
          [this](const robot::Command& command) {
            return engine::check_possible(*world_, simulation_->layout(), command);
          }};
}

void Run::begin_repeat(std::unique_ptr<Repeating> repeating) {
  if (pacer_) wanted_ = {pacer_->rate(), pacer_->paused()};
  options_.simulation.fleet.seed = static_cast<uint64_t>(repeating->header().seed);
  const std::lock_guard lock(simulation_mutex_);
  repeating_ = std::move(repeating);
  publisher_.mute(true);
}

std::string Run::take_turns() {
  try {
    take_turn();
    return "";
  } catch (const InputError& error) {
    if (!options_.repeat.empty()) throw;
    control_.cancel(error.what());  // the client gets this reply
    spdlog::error("{}. The run is paused", error.what());
    break_repeat_off();
    return error.what();
  }
}

void Run::take_turn() {
  while (!stop_) {
    const Mode::Turn turn = mode().turn(publisher_.step());
    switch (turn.what) {
      case Mode::Turn::What::nothing: return;
      case Mode::Turn::What::execute: mode().executed(execute(turn.request, Session{})); break;
      case Mode::Turn::What::end: return stop();
      case Mode::Turn::What::change_mode:
        repeating_->check_end(publisher_.latest() ? engine::state_hash(*publisher_.latest()) : 0);
        options_.repeat.clear();
        end_repeat(wanted_.paused);
        break;
    }
  }
}

// Inputs that were read ahead of it do not act any more.
void Run::break_repeat_off() {
  simulation_->inbox().clear();
  end_repeat(true);
}

void Run::end_repeat(bool paused) {
  pacer_->set_rate(wanted_.rate);
  if (paused) pacer_->pause();
  {
    const std::lock_guard lock(simulation_mutex_);
    repeating_.reset();
    publisher_.mute(false);
    begin_mode(*mode_, publisher_.step());
  }
  beats_.info.say();
}

}  // namespace ruedo::run
