// What each request of the simulation control does.
#include <cmath>

#include "ruedo/decode.h"
#include "ruedo/name_request_t.hpp"
#include "ruedo/rate_request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/state_reply_t.hpp"
#include "ruedo/step_request_t.hpp"
#include "log/header.h"
#include "run/server.h"
#include "engine/world_state.h"

namespace ruedo::run {
namespace {

template <class Body>
bool read_body(const request_t& request, Body& body) {
  return decode_checked(request.body.data(), request.body.size(), body) == DecodeFault::none;
}

engine::Outcome bad_body(const char* type) {
  return engine::Outcome::refuse(reply_t::BAD_REQUEST, std::string("the body is not a ") + type);
}

// What lockstep answers before there is a state.
bool is_before_begin(int32_t kind) {
  return kind == request_t::GRANT || kind == request_t::RESEND || kind == request_t::INFO || kind == request_t::QUIT || kind == request_t::STEP;
}

void put(const Pose& pose, const Twist& twist, state_reply_t& reply) {
  const Quat& q = pose.rotation;
  const double orientation[4] = {q.w(), q.x(), q.y(), q.z()};
  for (int i = 0; i < 3; ++i) {
    reply.position[i] = pose.translation[i];
    reply.linear[i] = twist.linear[i];
    reply.angular[i] = twist.angular[i];
  }
  std::copy(orientation, orientation + 4, reply.orientation);
}

}  // namespace

int64_t Server::features() const {
  int64_t bits = 0;
  constexpr int32_t kinds[] = {request_t::JOIN,  request_t::LEAVE,     request_t::PAUSE, request_t::RESUME,
                               request_t::STEP,  request_t::RATE,      request_t::RESET, request_t::GET_STATE,
                               request_t::INFO,  request_t::QUIT,      request_t::RESET_ODOMETRY, request_t::SPAWN,
                               request_t::REMOVE, request_t::SET_POSE, request_t::SET_TWIST};
  for (int32_t kind : kinds) bits |= int64_t{1} << kind;
  if (lockstep_) bits |= int64_t{1} << request_t::GRANT | int64_t{1} << request_t::RESEND;
  if (journal_) bits |= int64_t{1} << request_t::SNAPSHOT | int64_t{1} << request_t::RESTORE;
  return bits;
}

// What is repeated must not be disturbed: only who looks is answered meanwhile.
engine::Outcome Server::ask(const request_t& request, const Session& session) {
  const bool looks = request.kind == request_t::GET_STATE || request.kind == request_t::INFO || request.kind == request_t::QUIT;
  if (lockstep_ && !replay_ && !lockstep_->begun() && !is_before_begin(request.kind)) {
    return engine::Outcome::refuse(reply_t::REFUSED, "lockstep has not begun: call step(0), or grant. It waits for " + lockstep_->waits_for());
  }
  if (replay_ && !looks) return engine::Outcome::refuse(reply_t::REFUSED, "a snapshot is being restored: ask again when that is done");
  if (lockstep_ && request.kind == request_t::GRANT) return lockstep_->grant(request, session);
  if (lockstep_ && request.kind == request_t::RESEND) return lockstep_->resend(request, session);
  return execute(request);
}

engine::Outcome Server::execute(const request_t& request) {
  switch (request.kind) {
    case request_t::PAUSE: return pause();
    case request_t::RESUME: pacer_->resume(); return engine::Outcome::with(engine::encoded(state()));
    case request_t::STEP: return step(request);
    case request_t::RATE: return set_rate(request);
    case request_t::RESET: return reset(request);
    case request_t::GET_STATE: return get_state(request);
    case request_t::INFO: info_beat_.say(); return {};
    case request_t::QUIT: stop(); return {};
    case request_t::RESET_ODOMETRY: return reset_odometry(request);
    case request_t::SPAWN:
    case request_t::REMOVE:
    case request_t::SET_POSE:
    case request_t::SET_TWIST: return edit(request);
    case request_t::SNAPSHOT: return snapshot(request);
    case request_t::RESTORE: return restore(request);
    default: break;
  }
  return engine::Outcome::refuse(reply_t::NOT_SUPPORTED, "this server does not know requests of kind " + std::to_string(request.kind));
}

engine::Outcome Server::pause() {
  const int64_t last = pacer_->pause();
  control_.cancel_after(last, "a PAUSE ended it at step " + std::to_string(last));
  return engine::Outcome::after(last);
}

engine::Outcome Server::step(const request_t& request) {
  step_request_t body;
  if (!read_body(request, body)) return bad_body("step_request_t");
  if (body.steps < 1 || body.steps > kMostSteps) {
    return engine::Outcome::refuse(reply_t::BAD_REQUEST, "steps is " + std::to_string(body.steps) + "; 1 to " + std::to_string(kMostSteps) + " is allowed");
  }
  if (lockstep_) return engine::Outcome::refuse(reply_t::REFUSED, "in lockstep it is the clients' grants that step");
  if (!pacer_->paused()) return engine::Outcome::refuse(reply_t::REFUSED, "steps are taken while paused: pause first");
  return engine::Outcome::after(pacer_->allow(body.steps));
}

engine::Outcome Server::set_rate(const request_t& request) {
  rate_request_t body;
  if (!read_body(request, body)) return bad_body("rate_request_t");
  if (!(body.rate > 0.0)) return engine::Outcome::refuse(reply_t::BAD_REQUEST, "a rate is above 0, +inf for as fast as it goes");
  pacer_->set_rate(body.rate);
  return engine::Outcome::with(engine::encoded(state()));
}

engine::Outcome Server::reset(const request_t& request) {
  reset_request_t body;
  if (!read_body(request, body)) return bad_body("reset_request_t");
  if (body.what != reset_request_t::ALL && body.what != reset_request_t::TIME && body.what != reset_request_t::POSES) {
    return engine::Outcome::refuse(reply_t::BAD_REQUEST, "a reset of kind " + std::to_string(body.what) + "; there are 0 (all), 1 (time) and 2 (poses)");
  }
  if (body.what != reset_request_t::ALL) {
    if (body.seed != -1) return engine::Outcome::refuse(reply_t::BAD_REQUEST, "another seed goes with a reset of everything; -1 is allowed here");
    return body.what == reset_request_t::TIME ? reset_time(request) : reset_poses(request);
  }
  if (body.seed < -1) return engine::Outcome::refuse(reply_t::BAD_REQUEST, "a seed is 0 or more, -1 for the one there is");
  if (!replay_) control_.cancel("the world was reset");
  note(request);
  if (body.seed >= 0) options_.simulation.fleet.seed = static_cast<uint64_t>(body.seed);
  begin_epoch();
  return engine::Outcome::after(0);
}

void Server::note(const request_t& request) {
  applied_t applied;
  applied.utime = publisher_.time_us();
  applied.step = publisher_.step();
  applied.epoch = epoch_;
  applied.sequence = request.sequence;
  applied.channel = "ruedo/request";
  applied.kind = request.kind;
  applied.size = request.size;
  applied.data = request.body;
  publisher_.record(kAppliedChannel, applied);
}

void Server::note_files(const std::vector<std::string>& files) {
  if (files.empty() || !publisher_.has_recorders()) return;
  log_header_t header = header_;
  header.utime = publisher_.time_us();
  header.files = log::hashed_files(files);
  header.nfiles = static_cast<int32_t>(header.files.size());
  publisher_.record(kHeaderChannel, header);
}

void Server::begin_epoch() {
  header_.epoch = ++epoch_;
  header_.seed = static_cast<int64_t>(options_.simulation.fleet.seed);
  if (lockstep_) lockstep_->restart();
  make_simulation();
  if (journal_) journal_->begin(header_, publisher_.base_us());
  simulation_->start(*pacer_);
}

state_reply_t Server::state() const {
  state_reply_t reply;
  reply.utime = publisher_.time_us();
  reply.step = publisher_.step();
  reply.state_hash = publisher_.latest() ? engine::state_hash(*publisher_.latest()) : 0;
  reply.paused = pacer_->paused();
  reply.rate = pacer_->rate();
  put(Pose{}, Twist{}, reply);
  return reply;
}

engine::Outcome Server::get_state(const request_t& request) {
  name_request_t body;
  if (!read_body(request, body)) return bad_body("name_request_t");
  state_reply_t reply = state();
  reply.name = body.name;
  if (body.name.empty()) return engine::Outcome::with(engine::encoded(reply));
  const model::BodyLayout& layout = simulation_->layout();
  for (size_t i = 0; i < layout.links.size(); ++i) {
    const model::LinkPlacement& placement = layout.links[i];
    const model::ModelInstance& instance = world_->models[static_cast<size_t>(placement.instance)];
    if (instance.removed) continue;
    const model::Link& link = instance.model->links[static_cast<size_t>(placement.link)];
    const bool whole_model = body.name == instance.name && placement.link == 0;
    if (!whole_model && body.name != instance.name + "/" + link.name) continue;
    Pose X_WL = placement.X_BL;
    Twist twist;
    if (placement.body >= 0) {
      const Pose& X_WB = publisher_.latest()->bodies[static_cast<size_t>(placement.body)];
      const Twist& body_twist = publisher_.latest()->body_twists[static_cast<size_t>(placement.body)];
      X_WL = X_WB * placement.X_BL;
      const Pose X_WF = whole_model ? X_WL * link.X_ML.inverse() : X_WL;
      twist.angular = body_twist.angular;
      twist.linear = body_twist.linear + body_twist.angular.cross(X_WF.translation - X_WB.translation);
    }
    put(whole_model ? X_WL * link.X_ML.inverse() : X_WL, twist, reply);
    return engine::Outcome::with(engine::encoded(reply));
  }
  return engine::Outcome::refuse(reply_t::UNKNOWN_NAME, "there is no model or MODEL/LINK called '" + body.name + "'");
}

engine::Outcome Server::reset_odometry(const request_t& request) {
  name_request_t body;
  if (!read_body(request, body)) return bad_body("name_request_t");
  const model::BodyLayout& layout = simulation_->layout();
  for (size_t i = 0; i < layout.robots.size(); ++i) {
    if (world_->models[static_cast<size_t>(layout.robots[i].instance)].name != body.name) continue;
    simulation_->inbox().reset_odometry(static_cast<int>(i), request.body);
    return {};
  }
  return engine::Outcome::refuse(reply_t::UNKNOWN_NAME, "there is no robot called '" + body.name + "'");
}

}  // namespace ruedo::run
