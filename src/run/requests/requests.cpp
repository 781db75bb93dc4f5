// The table of requests, and those that steer the run or look at it. Those that change the world
// are in edit_requests.cpp, those of snapshots in snapshot_requests.cpp.
#include <algorithm>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "engine/world_state.h"
#include "robot/joint_control.h"
#include "ruedo/joint_limits_t.hpp"
#include "run/requests/request_table.h"
#include "run/run.h"

namespace ruedo::run {

using engine::Outcome;

// The functions of Run, as the table has them.
class RequestTable {
 public:
  template <Outcome (Run::*function)(const request_t&)>
  static Outcome plain(Run& run, const request_t& request, const Session&) {
    return (run.*function)(request);
  }

  template <Outcome (*function)(Run&)>
  static Outcome of(Run& run, const request_t&, const Session&) {
    return function(run);
  }

  template <class Body, Outcome (Run::*function)(const request_t&, const Body&)>
  static Outcome with(Run& run, const request_t& request, const Session&) {
    Body body;
    return read_body(request, body) ? (run.*function)(request, body) : bad_body<Body>();
  }

  static Outcome grant(Run& run, const request_t& request, const Session& session) {
    return run.mode().grant(request, session);
  }

  static const RequestKind kKinds[];
  static const RequestKind* find(int32_t kind);
};

constexpr RequestKind RequestTable::kKinds[] = {
    // name, kind, needs, effect, waits, function
    {"JOIN", request_t::JOIN, RequestKind::nothing, RequestKind::steers, RequestKind::for_nothing,
     nullptr},
    {"LEAVE", request_t::LEAVE, RequestKind::nothing, RequestKind::steers, RequestKind::for_nothing,
     nullptr},
    {"PAUSE", request_t::PAUSE, RequestKind::nothing, RequestKind::steers, RequestKind::for_state,
     plain<&Run::pause>},
    {"RESUME", request_t::RESUME, RequestKind::nothing, RequestKind::steers, RequestKind::for_state,
     plain<&Run::resume>},
    {"STEP", request_t::STEP, RequestKind::nothing, RequestKind::steers, RequestKind::for_state,
     with<step_request_t, &Run::step>},
    {"RATE", request_t::RATE, RequestKind::nothing, RequestKind::steers, RequestKind::for_state,
     with<rate_request_t, &Run::set_rate>},
    {"GET_STATE", request_t::GET_STATE, RequestKind::nothing, RequestKind::looks,
     RequestKind::for_state, with<name_request_t, &Run::get_state>},
    {"INFO", request_t::INFO, RequestKind::nothing, RequestKind::looks, RequestKind::for_nothing,
     plain<&Run::say_info>},
    {"QUIT", request_t::QUIT, RequestKind::nothing, RequestKind::looks, RequestKind::for_nothing,
     plain<&Run::quit>},
    {"RESET_ODOMETRY", request_t::RESET_ODOMETRY, RequestKind::nothing, RequestKind::steers,
     RequestKind::for_state, with<name_request_t, &Run::reset_odometry>},
    {"GET_JOINT_LIMITS", request_t::GET_JOINT_LIMITS, RequestKind::nothing, RequestKind::looks,
     RequestKind::for_state, with<name_request_t, &Run::get_joint_limits>},
    {"RESET", request_t::RESET, RequestKind::nothing, RequestKind::acts, RequestKind::for_state,
     with<reset_request_t, &Run::reset>},
    {"SPAWN", request_t::SPAWN, RequestKind::nothing, RequestKind::acts, RequestKind::for_state,
     with<spawn_request_t, &Run::spawn>},
    {"REMOVE", request_t::REMOVE, RequestKind::nothing, RequestKind::acts, RequestKind::for_state,
     with<name_request_t, &Run::remove>},
    {"SET_POSE", request_t::SET_POSE, RequestKind::nothing, RequestKind::acts,
     RequestKind::for_state, with<set_pose_request_t, &Run::set_pose>},
    {"SET_TWIST", request_t::SET_TWIST, RequestKind::nothing, RequestKind::acts,
     RequestKind::for_state, with<set_twist_request_t, &Run::set_twist>},
    {"GRANT", request_t::GRANT, RequestKind::grants, RequestKind::steers, RequestKind::for_nothing,
     grant},
    {"RESEND", request_t::RESEND, RequestKind::grants, RequestKind::steers,
     RequestKind::for_nothing, grant},
    {"SAVE", request_t::SAVE, RequestKind::save_file, RequestKind::looks, RequestKind::for_state,
     plain<&Run::save>},
    {"SNAPSHOT", request_t::SNAPSHOT, RequestKind::snapshots, RequestKind::steers,
     RequestKind::for_state, plain<&Run::snapshot>},
    {"RESTORE", request_t::RESTORE, RequestKind::snapshots, RequestKind::steers,
     RequestKind::for_state, with<name_request_t, &Run::restore>},
};

// A kind is a bit of `features`, and has one line.
static_assert([] {
  uint64_t seen = 0;
  for (const RequestKind& each : RequestTable::kKinds) {
    if (each.kind <= 0 || each.kind >= 63 || (seen >> each.kind & 1) != 0) return false;
    seen |= uint64_t{1} << each.kind;
  }
  return true;
}());

const RequestKind* RequestTable::find(int32_t kind) {
  const auto found = std::find_if(std::begin(kKinds), std::end(kKinds),
                                  [kind](const RequestKind& each) { return each.kind == kind; });
  return found == std::end(kKinds) ? nullptr : &*found;
}

const RequestKind* find_request_kind(int32_t kind) { return RequestTable::find(kind); }

bool Run::serves(const RequestKind& kind) const {
  switch (kind.needs) {
    case RequestKind::nothing: return true;
    case RequestKind::grants: return mode_->takes_grants();
    case RequestKind::snapshots: return journal_ != nullptr;
    case RequestKind::save_file: return edited_ && edited_->saves();
  }
  return false;
}

int64_t Run::features() const {
  int64_t bits = 0;
  for (const RequestKind& kind : RequestTable::kKinds) {
    if (serves(kind)) bits |= int64_t{1} << kind.kind;
  }
  return bits;
}

Outcome Run::admit(const request_t& request, const Session& session) {
  const RequestKind* kind = find_request_kind(request.kind);
  if (kind && serves(*kind)) {
    std::string refusal = mode().refusal(request.kind, kind->effect == RequestKind::looks);
    if (!refusal.empty() && !ends_restore(*kind))
      return Outcome::refuse(reply_t::REFUSED, std::move(refusal));
  }
  return execute(request, session);
}

// A client may cancel only a restore of a client; --restore is the command's own.
bool Run::ends_restore(const RequestKind& kind) const {
  return repeating_ && options_.repeat.empty() && kind.kind == request_t::PAUSE;
}

Outcome Run::execute(const request_t& request, const Session& session) {
  tell_readers();  // clients that subscribed before the STEP must see its messages
  const RequestKind* kind = find_request_kind(request.kind);
  if (!kind || !kind->execute) {
    return Outcome::refuse(reply_t::NOT_SUPPORTED, "this server does not know requests of kind " +
                                                       std::to_string(request.kind));
  }
  if (serves(*kind)) {
    if (kind->effect == RequestKind::acts || kind->needs == RequestKind::snapshots)
      stall_watch_.beat(std::string(kind->name) + " of '" + session.client + "'");
    return kind->execute(*this, request, session);
  }
  const char* const cure =
      kind->needs == RequestKind::grants
          ? "this run is not in lockstep: start the server with --lockstep N"
      : kind->needs == RequestKind::save_file
          ? "this run has no file to save the world to: start the server with ruedo edit"
          : "start the server with --snapshots FOLDER";
  return Outcome::refuse(reply_t::NOT_SUPPORTED, cure);
}

Outcome Run::pause(const request_t&) {
  if (repeating_) {
    control_.cancel(fmt::format("a PAUSE ended it at step {}", publisher_.step()));
    break_repeat_off();
  }
  const int64_t last = pacer_->pause();
  control_.cancel_after(last, "a PAUSE ended it at step " + std::to_string(last));
  return Outcome::after(last);
}

Outcome Run::resume(const request_t&) {
  pacer_->resume();
  return Outcome::with(engine::encoded(state()));
}

Outcome Run::step(const request_t&, const step_request_t& body) {
  if (body.steps < 1 || body.steps > kMostSteps) {
    return Outcome::refuse(reply_t::BAD_REQUEST, "steps is " + std::to_string(body.steps) +
                                                     "; 1 to " + std::to_string(kMostSteps) +
                                                     " is allowed");
  }
  if (mode().takes_grants())
    return Outcome::refuse(reply_t::REFUSED, "in lockstep it is the clients' grants that step");
  if (!pacer_->paused())
    return Outcome::refuse(reply_t::REFUSED, "steps are taken while paused: pause first");
  return Outcome::after(pacer_->allow(body.steps));
}

Outcome Run::set_rate(const request_t&, const rate_request_t& body) {
  if (!Pacer::takes(body.rate)) {
    return Outcome::refuse(reply_t::BAD_REQUEST,
                           fmt::format("the rate {} is not allowed; allowed are {} to {}, and +inf",
                                       body.rate, Pacer::kSlowest, Pacer::kFastest));
  }
  if (mode().takes_grants())
    return Outcome::refuse(reply_t::REFUSED, "in lockstep the clients' grants set the pace");
  pacer_->set_rate(body.rate);
  return Outcome::with(engine::encoded(state()));
}

Outcome Run::say_info(const request_t&) {
  beats_.info.say();
  return {};
}

Outcome Run::quit(const request_t&) {
  stop();
  return {};
}

namespace {

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

state_reply_t Run::state() const {
  state_reply_t reply;
  reply.utime = publisher_.time_us();
  reply.step = publisher_.step();
  reply.state_hash = publisher_.latest() ? engine::state_hash(*publisher_.latest()) : 0;
  reply.paused = pacer_->paused();
  reply.rate = pacer_->rate();
  put(Pose{}, Twist{}, reply);
  return reply;
}

Outcome Run::get_state(const request_t&, const name_request_t& body) {
  state_reply_t reply = state();
  reply.name = body.name;
  if (body.name.empty()) return Outcome::with(engine::encoded(reply));
  const world::BodyLayout& layout = simulation_->layout();
  for (size_t i = 0; i < layout.links.size(); ++i) {
    const world::LinkPlacement& placement = layout.links[i];
    const world::ModelInstance& instance = world_->models[placement.instance];
    if (instance.removed) continue;
    const world::Link& link = instance.model->links[placement.link];
    const bool whole_model = body.name == instance.name && placement.link == 0;
    if (!whole_model && body.name != instance.name + "/" + link.name) continue;
    Pose X_WL = placement.X_BL;
    Twist twist;
    if (placement.body.valid()) {
      const Pose& X_WB = publisher_.latest()->bodies[placement.body];
      const Twist& body_twist = publisher_.latest()->body_twists[placement.body];
      X_WL = X_WB * placement.X_BL;
      const Pose X_WF = whole_model ? X_WL * link.X_ML.inverse() : X_WL;
      twist.angular = body_twist.angular;
      twist.linear =
          body_twist.linear + body_twist.angular.cross(X_WF.translation - X_WB.translation);
    }
    put(whole_model ? X_WL * link.X_ML.inverse() : X_WL, twist, reply);
    return Outcome::with(engine::encoded(reply));
  }
  return Outcome::refuse(reply_t::UNKNOWN_NAME,
                         "there is no model or MODEL/LINK called '" + body.name + "'");
}

Outcome Run::reset_odometry(const request_t& request, const name_request_t& body) {
  const world::BodyLayout& layout = simulation_->layout();
  for (const RobotIndex robot : layout.robots.indices()) {
    if (world_->models[layout.robots[robot].instance].name != body.name) continue;
    simulation_->inbox().reset_odometry(robot, request.body);
    return {};
  }
  return Outcome::refuse(reply_t::UNKNOWN_NAME, "there is no robot called '" + body.name + "'");
}

namespace {

const char* kind_of(world::JointType type) {
  switch (type) {
    case world::JointType::fixed: return "fixed";
    case world::JointType::revolute: return "revolute";
    case world::JointType::continuous: return "continuous";
    case world::JointType::prismatic: return "prismatic";
    case world::JointType::ball: return "ball";
    case world::JointType::universal: return "universal";
    case world::JointType::screw: return "screw";
    case world::JointType::gearbox: return "gearbox";
  }
  return "";
}

void add_limits(const world::Joint& joint, joint_limits_t& reply) {
  const world::JointAxis& axis = joint.axis;
  const bool limited = axis.lower <= axis.upper;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  ++reply.n;
  reply.name.push_back(joint.name);
  reply.kind.emplace_back(kind_of(joint.type));
  reply.takes_commands.push_back(robot::takes_commands(joint));
  reply.holds.push_back(axis.start.mode != world::JointStart::Mode::free);
  reply.lower.push_back(limited ? axis.lower : -kNone);
  reply.upper.push_back(limited ? axis.upper : kNone);
  reply.velocity.push_back(axis.velocity);
  reply.effort.push_back(axis.effort);
}

}  // namespace

Outcome Run::get_joint_limits(const request_t&, const name_request_t& body) {
  const world::BodyLayout& layout = simulation_->layout();
  for (const world::RobotPlacement& robot : layout.robots) {
    const world::ModelInstance& instance = world_->models[robot.instance];
    if (instance.removed || instance.name != body.name) continue;
    joint_limits_t reply{};
    for (const JointIndex joint : robot.joints)
      add_limits(instance.model->joints[layout.joints[joint].joint], reply);
    return Outcome::with(engine::encoded(reply));
  }
  return Outcome::refuse(reply_t::UNKNOWN_NAME, "there is no robot called '" + body.name + "'");
}

}  // namespace ruedo::run
