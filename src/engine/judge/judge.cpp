// Goals, contacts, clearance and requests; odometry is in odometry_check.cpp.
#include "engine/judge/judge.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "base/channel_names.h"
#include "base/whole.h"
#include "physics/bodies/distances.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/fault_t.hpp"
#include "ruedo/math.h"
#include "ruedo/name_request_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/set_pose_request_t.hpp"
#include "ruedo/set_twist_request_t.hpp"
#include "ruedo/spawn_request_t.hpp"

namespace ruedo::judge {
namespace {

constexpr SimTime kTrackPeriod = 250'000;  // us
constexpr double kFall_m_s = 5.0;          // no wheel drops as far as gives that speed: 1.3 m

// Three decimals, or more where three would show the limit itself.
std::string beside(double value, double limit) {
  std::string text = fmt::format("{:.3f}", value);
  if (value == limit || text != fmt::format("{:.3f}", limit)) return text;
  return fmt::format("{:.6g}", value);
}

double seconds(SimTime time) { return static_cast<double>(time) * 1e-6; }

// The body of a request that acted, which was checked before.
template <class Body>
Body body_of(const applied_t& applied) {
  Body body{};
  decode_checked(applied.data.data(), applied.data.size(), body);
  return body;
}

}  // namespace

Goal parse_goal(const std::string& text) {
  double numbers[4];
  size_t begin = 0;
  for (int i = 0; i < 4; ++i) {
    const size_t end = i == 3 ? text.size() : std::min(text.find(',', begin), text.size());
    const auto [stop, error] = std::from_chars(text.data() + begin, text.data() + end, numbers[i]);
    if (begin > text.size() || error != std::errc() || stop != text.data() + end ||
        !std::isfinite(numbers[i]) || (i >= 2 && numbers[i] <= 0.0)) {
      throw InputError({}, "--goal '" + text +
                               "': it looks like X,Y,RADIUS,BY (m, m, m above 0, s above 0), for "
                               "example 3,2.5,0.2,60");
    }
    begin = end + 1;
  }
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

Judge::Judge(std::shared_ptr<const world::WorldModel> world, Expectations expected)
    : expected_(std::move(expected)), reached_(expected_.goals.size()) {
  expected_.clearance_reach =
      std::max(expected_.clearance_reach, expected_.clearance.value_or(0.0));
  const world::BodyLayout layout(*world);
  std::vector<std::string> names;
  for (const world::RobotPlacement& robot : layout.robots)
    names.push_back(world->models[robot.instance].name);
  if (expected_.robot.empty() && !names.empty()) expected_.robot = names.front();
  see_world(std::move(world), layout);
  if (!robot_.valid() && (!expected_.robot.empty() || expected_.any())) {
    throw InputError(
        {}, fmt::format("--robot '{}': the world has {}", expected_.robot,
                        names.empty() ? "no robot" : fmt::format("{}", fmt::join(names, ", "))));
  }
}

Judge::~Judge() = default;

void Judge::see_world(std::shared_ptr<const world::WorldModel> world,
                      const world::BodyLayout& layout) {
  distances_.reset();
  world_ = std::move(world);
  layout_.emplace(layout);
  robot_ = {};
  for (const RobotIndex i : layout_->robots.indices()) {
    const world::ModelInstance& instance = world_->models[layout_->robots[i].instance];
    if (!instance.removed && instance.name == expected_.robot) robot_ = i;
  }
  if (!robot_.valid()) return;
  const InstanceIndex instance = layout_->robots[robot_].instance;
  own_.resize(layout_->links.size());
  for (const LinkIndex i : layout_->links.indices())
    own_[i] = layout_->links[i].instance == instance;
  if (expected_.clearance || expected_.clearance_reach > 0.0)
    distances_ = std::make_unique<physics::Distances>(*world_, *layout_, instance);
}

void Judge::fail(const std::string& what, SimTime time, const std::string& text) {
  const bool known = std::any_of(failures_.begin(), failures_.end(),
                                 [&](const Check& check) { return check.what == what; });
  if (!known) failures_.push_back({what, Outcome::failed, text, time});
}

std::string Judge::name_of(LinkIndex link) const {
  const world::LinkPlacement& placement = layout_->links[link];
  const world::ModelInstance& instance = world_->models[placement.instance];
  return instance.name + "/" + instance.model->links[placement.link].name;
}

void Judge::see(const Snapshot& snapshot) {
  const bool goes_on = snapshot.time > seen_;  // else sim time was reset
  if (goes_on && snapshot.step > 0) ++steps_;
  seen_ = snapshot.time;
  if (!robot_.valid() || !snapshot.robots.has(robot_)) return;
  const RobotState& robot = snapshot.robots[robot_];
  const Vec3 position = robot.X_WBase.translation;
  if (!track_.empty()) path_m_ += (position - position_).head<2>().norm();
  position_ = position;
  if (track_.empty() || snapshot.time >= static_cast<SimTime>(track_.size()) * kTrackPeriod)
    track_.push_back({seconds(snapshot.time), position.x(), position.y()});
  if (goes_on && snapshot.step > 0) ++judged_;
  odometry_.see_truth(snapshot.time, robot.X_WBase, robot.odometry_resets);
  see_fall(snapshot.time, robot);
  see_goals(snapshot.time, position);
  see_contacts(snapshot);
  if (distances_) see_clearance(snapshot);
}

// A falling robot touches nothing, and may pass over a goal.
void Judge::see_fall(SimTime time, const RobotState& robot) {
  const double up = (robot.X_WBase.rotation * robot.twist.linear).z();
  if (up > -kFall_m_s) return;
  fail("fall", time,
       fmt::format("{} fell: at z = {:.2f} m it went down at {:.1f} m/s", expected_.robot,
                   robot.X_WBase.translation.z(), -up));
}

void Judge::see_goals(SimTime time, const Vec3& position) {
  for (size_t i = 0; i < expected_.goals.size(); ++i) {
    const Goal& goal = expected_.goals[i];
    const double distance = math::hypot(position.x() - goal.x, position.y() - goal.y);
    if (i + 1 == expected_.goals.size())
      last_goal_distance_m_ = std::min(last_goal_distance_m_, distance);
    if (!reached_[i] && seconds(time) <= goal.by_s && distance <= goal.radius) reached_[i] = time;
  }
}

void Judge::see_clearance(const Snapshot& snapshot) {
  const physics::Distances::Nearest nearest =
      distances_->nearest(snapshot, expected_.clearance_reach);
  smallest_clearance_m_ = std::min(smallest_clearance_m_, nearest.distance);
  if (!expected_.clearance || (nearest.distance >= *expected_.clearance && nearest.distance > 0.0))
    return;
  const Vec3& at = nearest.other_point;
  fail("clearance", snapshot.time,
       fmt::format("{} was {} m from {} at ({:.3f}, {:.3f}, {:.3f}), at least {:g} m are required",
                   name_of(nearest.own), beside(nearest.distance, *expected_.clearance),
                   name_of(nearest.other), at.x(), at.y(), at.z(), *expected_.clearance));
}

void Judge::see_contacts(const Snapshot& snapshot) {
  const Pose& X_WBase = snapshot.robots[robot_].X_WBase;
  const Vec3 up = X_WBase.rotation * Vec3::UnitZ();
  for (const Contact& contact : snapshot.contacts) {
    if (!own_.has(contact.link_a) || !own_.has(contact.link_b)) continue;
    const bool a = own_[contact.link_a], b = own_[contact.link_b];
    if (a == b) continue;
    // The ground presses upwards, low on the robot, as in physics::Distances.
    if (std::abs(contact.normal.dot(up)) > 0.7 &&
        (contact.position - X_WBase.translation).dot(up) < 0.02)
      continue;
    if (first_contact_ < 0) first_contact_ = snapshot.time;
    if (!expected_.no_contact) return;
    fail("contact", snapshot.time,
         fmt::format("{} touched {} at ({:.3f}, {:.3f}, {:.3f})",
                     name_of(a ? contact.link_a : contact.link_b),
                     name_of(a ? contact.link_b : contact.link_a), contact.position.x(),
                     contact.position.y(), contact.position.z()));
  }
}

void Judge::see(const std::string& channel, std::span<const uint8_t> message) {
  if (channel != expected_.robot + "/odometry") return;
  odometry_t odometry;
  if (decode_checked(message.data(), message.size(), odometry) == DecodeFault::none)
    odometry_.see(odometry);
}

// A motion by a request is not evidence of the robot's own ability.
void Judge::see(const applied_t& applied) {
  constexpr std::string_view kFault = "/fault";
  if (applied.channel.ends_with(kFault))
    return see_fault(applied.channel.substr(0, applied.channel.size() - kFault.size()), applied);
  if (applied.channel != kRequestChannel) return;
  std::string said, moved;  // the model that it moved
  switch (applied.kind) {
    case request_t::SPAWN: said = "SPAWN " + body_of<spawn_request_t>(applied).name; break;
    case request_t::REMOVE:
      moved = body_of<name_request_t>(applied).name;
      said = "REMOVE " + moved;
      break;
    case request_t::SET_POSE:
      moved = body_of<set_pose_request_t>(applied).name;
      said = "SET_POSE " + moved;
      break;
    case request_t::SET_TWIST:
      moved = body_of<set_twist_request_t>(applied).name;
      said = "SET_TWIST " + moved;
      break;
    case request_t::RESET:
      moved = expected_.robot;
      said = "RESET";
      break;
    case request_t::RESET_ODOMETRY:
      said = "RESET_ODOMETRY " + body_of<name_request_t>(applied).name;
      break;
    default: return;
  }
  changes_.push_back(said);
  const bool is_robots = moved == expected_.robot || moved.starts_with(expected_.robot + "/");
  if (!expected_.allow_requests && !moved.empty() && is_robots) {
    fail("requests", applied.utime,
         fmt::format("{} was moved by a request ({}); --allow-requests allows that",
                     expected_.robot, said));
  }
}

void Judge::see_fault(const std::string& robot, const applied_t& applied) {
  const auto fault = body_of<fault_t>(applied);
  changes_.push_back("fault " + fault.kind + " of " + robot);
  if (!expected_.allow_requests && robot == expected_.robot && fault.kind == "kidnapped")
    fail(
        "requests", applied.utime,
        robot + " was moved by a fault of the program's (kidnapped); --allow-requests allows that");
}

Verdict Judge::verdict() const {
  Verdict verdict;
  add_run(verdict);
  add_goals(verdict);
  if (expected_.no_contact)
    add_kept(verdict, "contact", fmt::format("{} touched nothing", expected_.robot));
  if (expected_.clearance) {
    const bool none = !(smallest_clearance_m_ < expected_.clearance_reach);
    add_kept(verdict, "clearance",
             fmt::format("clearance {}{:.3f} m", none ? "of at least " : "",
                         std::min(smallest_clearance_m_, expected_.clearance_reach)));
  }
  if (expected_.odometry_error) add_odometry(verdict);
  for (const Check& check : failures_) {
    if (check.what == "requests" || check.what == "fall") verdict.checks.push_back(check);
  }
  verdict.metrics = metrics();
  verdict.track = track_;
  return verdict;
}

void Judge::add_run(Verdict& verdict) const {
  if (steps_ == 0) {
    verdict.checks.push_back({"run", Outcome::not_judged, "no step was run", {}});
    return;
  }
  std::string text = fmt::format("{} steps", steps_);
  if (!changes_.empty()) {
    constexpr size_t kMostTold = 5;
    const auto end =
        changes_.begin() + static_cast<std::ptrdiff_t>(std::min(changes_.size(), kMostTold));
    text += fmt::format(" ({} requests changed the run: {}{})", changes_.size(),
                        fmt::join(changes_.begin(), end, ", "),
                        changes_.size() > kMostTold ? ", ..." : "");
  }
  verdict.checks.push_back({"run", Outcome::passed, text, {}});
}

void Judge::add_goals(Verdict& verdict) const {
  for (size_t i = 0; i < expected_.goals.size(); ++i) {
    const Goal& goal = expected_.goals[i];
    const std::string what = fmt::format("goal {}", i);
    if (reached_[i]) {
      verdict.checks.push_back({what,
                                Outcome::passed,
                                fmt::format("{} reached at {:.3g} s", what, seconds(*reached_[i])),
                                {}});
      continue;
    }
    const std::string ended =
        seconds(seen_) < goal.by_s ? fmt::format("; the run ended at {:g} s", seconds(seen_)) : "";
    verdict.checks.push_back(
        {what, Outcome::failed,
         fmt::format("{} was not within {:g} m of ({:g}, {:g}) by {:g} s{}", expected_.robot,
                     goal.radius, goal.x, goal.y, goal.by_s, ended),
         microseconds(goal.by_s)});
  }
}

// The conditions of each step.
void Judge::add_kept(Verdict& verdict, const std::string& what, const std::string& evidence) const {
  const auto failed = std::find_if(failures_.begin(), failures_.end(),
                                   [&](const Check& check) { return check.what == what; });
  if (failed != failures_.end()) {
    verdict.checks.push_back(*failed);
  } else if (judged_ == 0) {
    verdict.checks.push_back({what, Outcome::not_judged, what + ": no step was run", {}});
  } else {
    verdict.checks.push_back(
        {what, Outcome::passed, fmt::format("{} over {} steps", evidence, judged_), {}});
  }
}

void Judge::add_odometry(Verdict& verdict) const {
  const OdometryCheck::Result result = odometry_.compare(*expected_.odometry_error);
  Check check{
      "odometry",
      Outcome::passed,
      fmt::format("odometry at most {:.3f} m off in {} samples", result.largest_m, result.samples),
      {}};
  if (result.samples == 0) {
    check.outcome = Outcome::not_judged;
    check.text = fmt::format("odometry: {}/odometry has no sample", expected_.robot);
  } else if (result.beyond) {
    check.outcome = Outcome::failed;
    check.time = result.beyond;
    check.text =
        fmt::format("{}'s odometry was {} m off, at most {:g} m are allowed", expected_.robot,
                    beside(result.beyond_m, *expected_.odometry_error), *expected_.odometry_error);
  }
  verdict.checks.push_back(std::move(check));
}

std::vector<Metric> Judge::metrics() const {
  std::vector<Metric> metrics{{"time_s", seconds(seen_)},
                              {"x_m", position_.x()},
                              {"y_m", position_.y()},
                              {"path_m", path_m_}};
  if (!expected_.goals.empty()) metrics.push_back({"goal_distance_m", last_goal_distance_m_});
  if (!reached_.empty() && std::all_of(reached_.begin(), reached_.end(),
                                       [](const auto& at) { return at.has_value(); })) {
    metrics.push_back(
        {"goal_time_s", seconds(**std::max_element(reached_.begin(), reached_.end()))});
  }
  if (first_contact_ >= 0) metrics.push_back({"contact_time_s", seconds(first_contact_)});
  if (expected_.clearance_reach > 0.0)
    metrics.push_back({"clearance_m", std::min(smallest_clearance_m_, expected_.clearance_reach)});
  const OdometryCheck::Result odometry = odometry_.compare(0.0);
  if (odometry.samples > 0) metrics.push_back({"odometry_error_m", odometry.largest_m});
  return metrics;
}

}  // namespace ruedo::judge
