// Commands of the log go to the inbox, its requests to the run.
#include "run/repeat/repeating.h"

#include "base/channel_names.h"
#include "log/header.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/name_request_t.hpp"

namespace ruedo::run {

Repeating::Repeating(const std::string& path, const Mode* after) : replay_(path), after_(after) {
  log::check_files_of_spawned(path);
  if (!after_) return;
  length_ = length_of(path);
  if (!length_.fault.empty()) throw InputError({path}, "is not a snapshot: " + length_.fault);
  progress_.emplace("restoring " + path, length_.steps);
}

void Repeating::begin(const Stage& stage, int64_t) {
  stage_ = stage;
  if (begin_us_ < 0) begin_us_ = stage.base_us;
  stage_.gate->set_limit(-1);  // turn() sets the limit
}

Mode::Turn Repeating::turn(int64_t step) {
  if (step < last_) before_ += last_;
  last_ = step;
  if (progress_) progress_->to(before_ + step);
  const Replay::Target target{*stage_.inbox, *stage_.gate,
                              [this](const applied_t& applied) { return input_of(applied); },
                              stage_.base_us - begin_us_};
  if (const applied_t* applied = replay_.advance(step, target)) {
    Turn turn{Turn::What::execute};
    turn.request.kind = applied->kind;
    turn.request.sequence = applied->sequence;
    turn.request.size = applied->size;
    turn.request.body = applied->data;
    return turn;
  }
  if (!replay_.at_end(step)) return {};
  return {after_ ? Turn::What::change_mode : Turn::What::end};
}

void Repeating::executed(const engine::Outcome& outcome) {
  if (outcome.code != reply_t::OK) {
    throw InputError({path()}, "cannot be repeated: its request of kind " +
                                   std::to_string(replay_.applied().kind) + " at step " +
                                   std::to_string(replay_.applied().step) +
                                   " is refused: " + outcome.text);
  }
  replay_.executed();
}

void Repeating::check_end(int64_t state_hash) const {
  const int64_t saved = replay_.end().state_hash;
  if (saved != 0 && state_hash != saved) {  // 0: saved when that state was past
    throw InputError({path()},
                     "leads to another state here than where it was saved: the program, libraries "
                     "or CPU differ");
  }
}

std::string Repeating::refusal(int32_t, bool looks) const {
  return looks ? "" : "a snapshot is being restored: ask again when that is done";
}

bool Repeating::early(const request_t&, const Session&) const {
  return after_ && after_->takes_grants();
}

engine::InputIndex Repeating::input_of(const applied_t& applied) const {
  const bool is_request = applied.channel == kRequestChannel;
  if (is_request && applied.kind != request_t::RESET_ODOMETRY) return {};
  name_request_t body;
  if (is_request) decode_checked(applied.data.data(), applied.data.size(), body);
  const auto& inputs = stage_.inbox->inputs();
  for (const engine::InputIndex i : inputs.indices()) {
    const bool reset = inputs[i].kind == engine::Input::Kind::reset_odometry;
    const bool fits = is_request ? reset && stage_.robot_name(inputs[i].robot) == body.name
                                 : !reset && inputs[i].channel == applied.channel;
    if (fits) return i;
  }
  throw InputError(
      {path()}, "cannot be repeated: there is no channel '" + applied.channel + "' in this world");
}

}  // namespace ruedo::run
