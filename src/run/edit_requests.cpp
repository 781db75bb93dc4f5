// Requests that change the world between two steps, or the time.
//
// The pacer holds, what is under way is published, and then nothing moves: the simulation's thread waits in the pacer, the
// modules at their queues. So the change needs no lock against any of them.
#include <spdlog/spdlog.h>

#include "ruedo/decode.h"
#include "ruedo/name_request_t.hpp"
#include "engine/edits.h"
#include "run/server.h"

namespace ruedo::run {
namespace {

constexpr size_t kFindingsTold = 5;

template <class Body>
bool read_body(const request_t& request, Body& body) {
  return decode_checked(request.body.data(), request.body.size(), body) == DecodeFault::none;
}

engine::Outcome bad_body(const char* type) { return engine::Outcome::refuse(reply_t::BAD_REQUEST, std::string("the body is not a ") + type); }

}  // namespace

bool Server::stand_still() {
  const int64_t last = pacer_->hold();
  while (publisher_.step() < last) {
    if (simulation_->over()) return false;    // a state that cannot be ends a run before its time
    if (const engine::Batch* batch = simulation_->take()) publish(*batch);
    else wakeup_.wait();
  }
  return pacer_->wait_until_held();
}

void Server::move_on() {
  pacer_->release();
  wakeup_.set();    // what came meanwhile
}

engine::Outcome Server::change(const request_t& request, bool models, const std::function<engine::Outcome()>& apply) {
  if (lockstep_ && lockstep_->full()) return engine::Outcome::refuse(reply_t::REFUSED, "not all clients have the messages of the last steps: ask again");
  if (!stand_still()) return engine::Outcome::refuse(reply_t::REFUSED, "the run is over");
  engine::Outcome outcome;
  {
    const std::lock_guard lock(simulation_mutex_);
    outcome = apply();
    if (models) world_ = std::make_shared<const model::WorldModel>(simulation_->world());
  }
  if (outcome.code == reply_t::OK) {
    note(request);
    changed_ = publisher_.latest() ? *publisher_.latest() : Snapshot{};
    simulation_->robots().read(changed_);
    changed_.step = publisher_.step();
    changed_.time = publisher_.time_us();
    publisher_.change_latest(changed_);
    if (models) announce();
    if (models && !replay_) info_beat_.say();
  }
  move_on();
  return outcome;
}

engine::Outcome Server::edit(const request_t& request) {
  switch (request.kind) {
    case request_t::SPAWN: return spawn(request);
    case request_t::REMOVE: {
      name_request_t body;
      if (!read_body(request, body)) return bad_body("name_request_t");
      return change(request, true, [&] { return engine::remove(body.name, *simulation_, channels_); });
    }
    case request_t::SET_POSE: {
      set_pose_request_t body;
      if (!read_body(request, body)) return bad_body("set_pose_request_t");
      return change(request, false, [&] { return engine::set_pose(body, *simulation_); });
    }
    default: {
      set_twist_request_t body;
      if (!read_body(request, body)) return bad_body("set_twist_request_t");
      return change(request, false, [&] { return engine::set_twist(body, *simulation_); });
    }
  }
}

engine::Outcome Server::spawn(const request_t& request) {
  spawn_request_t body;
  if (!read_body(request, body)) return bad_body("spawn_request_t");
  if (engine::Outcome outcome = engine::check_spawn(body); outcome.code != reply_t::OK) return outcome;
  if (!replay_) return worker_.add({request, std::move(body)});
  try {
    return put_in(request, body, models_.load(body));
  } catch (const InputError& error) {
    return engine::Outcome::refuse(reply_t::BAD_REQUEST, error.what());
  }
}

// In lockstep what is granted is computed first: so who waits for the answer knows the step.
void Server::spawn_ready() {
  for (;; made_.reset()) {
    if (!made_) {
      made_ = worker_.take();
      if (!made_) return;
      enters_at_ = lockstep_ ? lockstep_->limit() : -1;
    }
    const request_t& request = made_->request;
    if (!control_.is_pending(request.session, request.sequence)) continue;    // the world was reset meanwhile
    if (publisher_.step() < enters_at_ && !pacer_->paused()) return;
    control_.finish(request.session, request.sequence,
                    made_->fault.empty() ? put_in(request, made_->body, made_->loaded) : engine::Outcome::refuse(reply_t::BAD_REQUEST, made_->fault));
  }
}

engine::Outcome Server::put_in(const request_t& request, const spawn_request_t& body, const model::LoadedModel& loaded) {
  std::string name;
  const engine::Outcome outcome = change(request, true, [&] {
    return engine::spawn(body, loaded, publisher_.step() + 1, *simulation_, channels_, name);
  });
  if (outcome.code == reply_t::OK) note_files(loaded.files_read);
  if (outcome.code != reply_t::OK || replay_) return outcome;
  spdlog::info("{} was spawned at step {}", name, publisher_.step());
  for (size_t i = 0; i < std::min(loaded.findings.size(), kFindingsTold); ++i) {
    const Finding& finding = loaded.findings[i];
    spdlog::warn("{}: {}: {}", finding.source.str(), finding.element, finding.text);
  }
  name_request_t which;    // the answer says what its name is, and where it stands
  which.name = name;
  request_t look = request;
  look.body = engine::encoded(which);
  return publisher_.latest() ? get_state(look) : outcome;
}

engine::Outcome Server::reset_poses(const request_t& request) {
  const engine::Outcome outcome = change(request, false, [&] { return engine::reset_poses(*simulation_), engine::Outcome{}; });
  return outcome.code == reply_t::OK ? engine::Outcome::with(engine::encoded(state())) : outcome;
}

engine::Outcome Server::reset_time(const request_t& request) {
  if (!stand_still()) return engine::Outcome::refuse(reply_t::REFUSED, "the run is over");
  if (!replay_) control_.cancel("sim time was reset");
  note(request);
  header_.epoch = ++epoch_;
  pacer_->begin_time_anew();
  {
    const std::lock_guard lock(simulation_mutex_);
    simulation_->begin_time_anew(epoch_);
    if (wait_for_ && !replay_) {
      wait_for_->detach();
      wait_for_->attach(channels_, simulation_->inbox(), *pacer_, 0);
    }
  }
  if (replay_) pacer_->set_limit(-1);
  if (lockstep_) {
    lockstep_->restart();
    lockstep_->attach(simulation_->inbox(), *pacer_);
  }
  publisher_.begin_epoch(epoch_);
  announce();
  move_on();
  return engine::Outcome::after(0);
}

}  // namespace ruedo::run
