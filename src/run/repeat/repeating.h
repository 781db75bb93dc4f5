// A run that repeats a log, or the log that a snapshot is: for `ruedo verify`, and to restore a
// snapshot.
//
// A snapshot is what acted on the world up to its step. Physics keeps contacts, their impulses and
// the order of its pairs from step to step; running up to the step gives them back exactly.
// Meanwhile commands are ignored, and requests that change something refused.
#pragma once

#include <optional>
#include <string>

#include "base/progress.h"
#include "run/mode.h"
#include "run/repeat/replay.h"

namespace ruedo::run {

class Repeating : public Mode {
 public:
  // after: the mode in which the run continues; null: the run ends with the log. Throws InputError
  // if the file is not a log, or is truncated and the run shall continue.
  Repeating(const std::string& path, const Mode* after);

  // The number of steps; known if the run continues afterwards.
  int64_t steps() const { return length_.steps; }
  const log_header_t& header() const { return replay_.header(); }
  const std::string& path() const { return replay_.path(); }
  // Throws InputError when the log says that it ends in another state.
  void check_end(int64_t state_hash) const;

  void begin(const Stage& stage, int64_t step) override;
  Turn turn(int64_t step) override;
  void executed(const engine::Outcome& outcome) override;
  bool on_message(const std::string&, const uint8_t*, size_t) override { return true; }
  std::string refusal(int32_t kind, bool looks) const override;
  bool early(const request_t& request, const Session& session) const override;

 private:
  // None: a request that the run executes.
  engine::InputIndex input_of(const applied_t& applied) const;

  Replay replay_;
  const Mode* after_;
  Length length_;                     // if the run continues afterwards
  std::optional<Progress> progress_;  // as length_
  int64_t before_ = 0, last_ = -1;    // steps before sim time was reset, and the last one since
  Stage stage_;
  SimTime begin_us_ = -1;  // the stamp at which the first epoch began; -1: it has not
};

}  // namespace ruedo::run
