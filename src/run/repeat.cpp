// Repeating what is in a log: for `ruedo verify`, and to restore a snapshot.
//
// A snapshot is what acted on the world up to its step. Bullet keeps contacts, their impulses and the order of its pairs
// from step to step, and gives no way to put them back exactly; running up to the step does.
#include <filesystem>

#include <spdlog/spdlog.h>

#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/name_request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "log/header.h"
#include "run/server.h"
#include "engine/world_state.h"

namespace ruedo::run {

void Server::begin_repeat(const std::string& path) {
  auto replay = std::make_unique<Replay>(path);
  log::check_files_of_spawned(path);
  after_repeat_ = {pacer_ ? pacer_->rate() : options_.rate, pacer_ ? pacer_->paused() : options_.paused};
  options_.simulation.fleet.seed = static_cast<uint64_t>(replay->header().seed);
  if (!pacer_) epoch_ = replay->header().epoch;
  replay_ = std::move(replay);
  repeating_ = true;
  publisher_.mute(true);
}

void Server::repeat() {
  try {
    while (replay_) {
      const Replay::Target target{simulation_->inbox(), *pacer_, [this](const applied_t& applied) { return input_of(applied); },
                                  publisher_.base_us() - repeat_begin_us_};
      if (const applied_t* applied = replay_->advance(publisher_.step(), target)) {
        repeat_request(*applied);
        replay_->executed();
      } else if (replay_->at_end(publisher_.step())) {
        end_repeat();
      } else {
        return;
      }
    }
  } catch (const InputError& error) {
    if (!options_.repeat.empty()) throw;
    // Who asked for it is told, and the world stays where it got to.
    control_.cancel(error.what());
    spdlog::error("{}. The run is paused", error.what());
    go_on(true);
  }
}

void Server::repeat_request(const applied_t& applied) {
  request_t request;
  request.kind = applied.kind;
  request.sequence = applied.sequence;
  request.size = applied.size;
  request.body = applied.data;
  const engine::Outcome outcome = execute(request);
  if (outcome.code == reply_t::OK) return;
  throw InputError({replay_->path()}, "cannot be repeated: its request of kind " + std::to_string(request.kind) + " at step " +
                                          std::to_string(applied.step) + " is refused: " + outcome.text);
}

void Server::end_repeat() {
  if (options_.end_with_repeat) {
    replay_.reset();
    return stop();
  }
  const std::string path = replay_->path();
  if (!replay_->complete()) throw InputError({path}, "is no snapshot: " + replay_->fault());
  if (!publisher_.latest() || engine::state_hash(*publisher_.latest()) != replay_->end().state_hash) {
    throw InputError({path}, "leads to another state here than where it was saved: its program, libraries or CPU are others");
  }
  options_.repeat.clear();
  go_on(after_repeat_.paused);
}

void Server::go_on(bool paused) {
  replay_.reset();
  repeating_ = false;
  publisher_.mute(false);
  pacer_->set_rate(after_repeat_.rate);
  if (paused) pacer_->pause();
  if (lockstep_) lockstep_->begin_at(publisher_.step());
  else pacer_->set_limit(std::numeric_limits<int64_t>::max());
  if (wait_for_) {
    const std::lock_guard lock(simulation_mutex_);
    wait_for_->attach(channels_, simulation_->inbox(), *pacer_, publisher_.step());
  }
  info_beat_.say();
}

int Server::input_of(const applied_t& applied) const {
  const std::vector<engine::Input>& inputs = simulation_->inbox().inputs();
  const auto robot_name = [this](int robot) {
    return world_->models[static_cast<size_t>(simulation_->layout().robots[static_cast<size_t>(robot)].instance)].name;
  };
  if (applied.channel == "ruedo/request" && applied.kind != request_t::RESET_ODOMETRY) return -1;
  name_request_t body;
  if (applied.channel == "ruedo/request") {
    decode_checked(applied.data.data(), applied.data.size(), body);
  }
  for (size_t i = 0; i < inputs.size(); ++i) {
    const bool reset = inputs[i].kind == engine::Input::Kind::reset_odometry;
    if (applied.channel != "ruedo/request" ? !reset && inputs[i].channel == applied.channel : reset && robot_name(inputs[i].robot) == body.name) {
      return static_cast<int>(i);
    }
  }
  throw InputError({replay_->path()}, "cannot be repeated: there is no channel '" + applied.channel + "' in this world");
}

engine::Outcome Server::snapshot(const request_t& request) {
  if (!journal_) return engine::Outcome::refuse(reply_t::NOT_SUPPORTED, "start the server with --snapshots FOLDER");
  name_request_t body;
  if (decode_checked(request.body.data(), request.body.size(), body) != DecodeFault::none) {
    return engine::Outcome::refuse(reply_t::BAD_REQUEST, "the body is not a name_request_t");
  }
  if (journal_->snapshot_path(body.name).empty()) {
    return engine::Outcome::refuse(reply_t::BAD_REQUEST, "'" + body.name + "' is no name of a snapshot: 1 to 63 letters, digits, '_', '-' and '.', not first a '.'");
  }
  const std::string fault = journal_->save_snapshot(body.name, hashes_.now(true), publisher_.base_us() + publisher_.time_us());
  if (!fault.empty()) return engine::Outcome::refuse(reply_t::REFUSED, "the snapshot was not saved: " + fault);
  return engine::Outcome::with(engine::encoded(state()));
}

// In the log it is a reset, and the run up to the snapshot's step: so the log needs no other file to be repeated.
engine::Outcome Server::restore(const request_t& request) {
  if (!journal_) return engine::Outcome::refuse(reply_t::NOT_SUPPORTED, "start the server with --snapshots FOLDER");
  name_request_t body;
  if (decode_checked(request.body.data(), request.body.size(), body) != DecodeFault::none) {
    return engine::Outcome::refuse(reply_t::BAD_REQUEST, "the body is not a name_request_t");
  }
  if (lockstep_) return engine::Outcome::refuse(reply_t::REFUSED, "a run in lockstep cannot be set to a snapshot: start one with --restore");
  const std::string path = journal_->snapshot_path(body.name);
  if (path.empty() || !std::filesystem::exists(path)) {
    return engine::Outcome::refuse(reply_t::UNKNOWN_NAME, "there is no snapshot '" + body.name + "'");
  }
  try {
    reset_request_t reset;
    reset.what = reset_request_t::ALL;
    const log_header_t header = read_header(path);
    log::check_same_run(header, header_, path);
    reset.seed = header.seed == header_.seed ? -1 : header.seed;
    control_.cancel("a snapshot is restored");
    request_t noted = request;
    noted.kind = request_t::RESET;
    noted.body = engine::encoded(reset);
    noted.size = static_cast<int32_t>(noted.body.size());
    note(noted);
    begin_repeat(path);
  } catch (const InputError& error) {
    return engine::Outcome::refuse(reply_t::REFUSED, error.what());
  }
  begin_epoch();
  repeat_begin_us_ = publisher_.base_us();
  repeat();
  return engine::Outcome::after(0);
}

}  // namespace ruedo::run
