// The messages of a run at fixed rates of sim time: ticks, ruedo/info, hashes of the state, and
// warnings on the terminal.
//
// Each is a sink that publishes at the end of a step.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "ruedo/state_hash_t.hpp"
#include "run/publisher.h"
#include "run/tick.h"

namespace ruedo::run {

// The steps at which something is due.
class Beat {
 public:
  Beat(Rate rate, int64_t step_us) : clock_(rate, step_us) {}
  // Whether it is at this step. Fast for steps that follow on one another.
  bool due(int64_t step);

 private:
  SampleClock clock_;
  int64_t last_ = -1, next_ = 0;  // steps: the requested one, the first due at or after it
};

// ruedo/tick, with the list of the step's messages.
class Ticks : public Sink {
 public:
  using Time = std::chrono::steady_clock::time_point;
  // Adds the last request or grant of each client that acted before that step.
  using AddApplied = std::function<void(TickWriter& tick, int64_t step)>;

  // Whether a step has a tick for another reason than the rate.
  using Wanted = std::function<bool(int64_t step)>;

  Ticks(Publisher& publisher, int64_t run_id, Rate rate, int64_t step_us, AddApplied add_applied,
        Wanted wanted)
      : publisher_(publisher),
        run_id_(run_id),
        beat_(rate, step_us),
        add_applied_(std::move(add_applied)),
        wanted_(std::move(wanted)) {}

  // It lists what there is.
  bool wants(const std::string&) const override { return false; }
  void begin_step(const Step& step) override;
  void message(const Published& message) override;
  void end_step(const Step& step) override;

  // Of the last state, without the list of its messages.
  void say();

  Time last() const { return last_; }           // in real time
  SimTime told_us() const { return told_us_; }  // the time of the last tick

 private:
  void finish();

  Publisher& publisher_;
  const int64_t run_id_;
  Beat beat_;
  const AddApplied add_applied_;
  const Wanted wanted_;
  TickWriter tick_;
  bool due_ = false;
  Time last_ = std::chrono::steady_clock::now();
  SimTime told_us_ = -1;
};

// ruedo/info, once a second of sim time and whenever asked.
class InfoBeat : public Sink {
 public:
  using Time = std::chrono::steady_clock::time_point;

  InfoBeat(Publisher& publisher, int64_t step_us, std::function<bool()> paused)
      : publisher_(publisher), beat_(engine::kInfoRate, step_us), paused_(std::move(paused)) {}

  void say();

  void announce(const std::shared_ptr<const Announcement>& announcement) override {
    info_ = announcement->info;
  }
  Hears hears() const override { return {.samples = false}; }
  void message(const Published&) override {}
  void end_step(const Step& step) override {
    if (beat_.due(step.step)) say();
  }

  Time last() const { return last_; }  // in real time

 private:
  Publisher& publisher_;
  Beat beat_;
  const std::function<bool()> paused_;
  std::vector<world_info_t> info_;
  Time last_{};
};

// ruedo/state_hash, once a second of sim time: for logs.
class HashBeat : public Sink {
 public:
  HashBeat(Publisher& publisher, int64_t step_us) : publisher_(publisher), beat_({1, 1}, step_us) {}

  // Of the state as it is now.
  state_hash_t now() const;
  state_hash_t at_end() const;  // the same, as a run or a snapshot ends with it

  Hears hears() const override { return {.samples = false, .repeated = true}; }
  void message(const Published&) override {}
  void end_step(const Step& step) override;

 private:
  Publisher& publisher_;
  Beat beat_;
};

// Says on the terminal, once for each robot's name, that its watchdog stopped it. A robot that is
// spawned may have the number of one that was removed.
class WatchdogWarnings : public Sink {
 public:
  // By its number in the layout.
  using Robot = std::function<const world::ModelInstance&(RobotIndex robot)>;

  WatchdogWarnings(const Publisher& publisher, int64_t step_us, Robot robot)
      : publisher_(publisher), beat_(engine::kTickRate, step_us), robot_(std::move(robot)) {}

  Hears hears() const override { return {.samples = false}; }
  void message(const Published&) override {}
  void end_step(const Step& step) override;

 private:
  const Publisher& publisher_;
  Beat beat_;
  const Robot robot_;
  std::set<std::string> told_;
};

}  // namespace ruedo::run
