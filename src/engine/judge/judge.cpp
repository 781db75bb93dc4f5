// Goals, contacts and odometry; clearance is in judge_hull.cpp.
#include "engine/judge/judge.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "base/whole.h"
#include "engine/judge/judge_hull.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/math.h"

namespace ruedo::judge {
namespace {

constexpr SimTime kTrackPeriod = 250'000;  // us

double seconds(SimTime time) { return static_cast<double>(time) * 1e-6; }

// Of a quaternion w, x, y, z.
double heading_of(const double* q) {
  return math::atan2(2.0 * (q[0] * q[3] + q[1] * q[2]), 1.0 - 2.0 * (q[2] * q[2] + q[3] * q[3]));
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

Judge::Judge(const world::WorldModel& world, Expectations expected)
    : world_(world), expected_(std::move(expected)), layout_(world) {
  IndexedVector<RobotIndex, std::string> names;
  for (const RobotIndex i : layout_.robots.indices()) {
    const std::string& name = world.models[layout_.robots[i].instance].name;
    names.push_back(name);
    if (!robot_.valid() && (expected_.robot.empty() || expected_.robot == name)) robot_ = i;
  }
  if (!robot_.valid())
    throw InputError(
        {}, fmt::format("--robot '{}': the world has {}", expected_.robot,
                        names.empty() ? "no robot" : fmt::format("{}", fmt::join(names, ", "))));
  expected_.robot = names[robot_];
  const InstanceIndex instance = layout_.robots[robot_].instance;
  own_.resize(layout_.links.size());
  wheel_.resize(layout_.links.size());
  for (const LinkIndex i : layout_.links.indices()) own_[i] = layout_.links[i].instance == instance;
  for (const world::WheelPlacement& wheel : layout_.wheels)
    wheel_[wheel.link] = wheel.robot == robot_;
  reached_.resize(expected_.goals.size());
  expected_.clearance_reach =
      std::max(expected_.clearance_reach, expected_.clearance.value_or(0.0));
  if (expected_.clearance_reach > 0.0) hull_ = std::make_unique<JudgeHull>(world_, layout_, robot_);
}

Judge::~Judge() = default;

void Judge::fail(const std::string& what, SimTime time, const std::string& text) {
  const bool known = std::any_of(failures_.begin(), failures_.end(),
                                 [&](const Failure& f) { return f.what == what; });
  if (!known) failures_.push_back({what, time, text});
}

std::string Judge::name_of(LinkIndex link) const {
  const world::LinkPlacement& placement = layout_.links[link];
  const world::ModelInstance& instance = world_.models[placement.instance];
  return instance.name + "/" + instance.model->links[placement.link].name;
}

void Judge::see(const Snapshot& snapshot) {
  if (!snapshot.robots.has(robot_)) return;
  const Vec3 position = snapshot.robots[robot_].X_WBase.translation;
  if (seen_ >= 0) path_m_ += (position - position_).head<2>().norm();
  seen_ = snapshot.time;
  position_ = position;
  if (snapshot.time >= static_cast<SimTime>(track_.size()) * kTrackPeriod)
    track_.push_back({seconds(snapshot.time), position.x(), position.y()});
  for (size_t i = 0; i < expected_.goals.size(); ++i) {
    const Goal& goal = expected_.goals[i];
    const double distance = math::hypot(position.x() - goal.x, position.y() - goal.y);
    if (i + 1 == expected_.goals.size())
      last_goal_distance_m_ = std::min(last_goal_distance_m_, distance);
    if (reached_[i] || seconds(snapshot.time) > goal.by_s || distance > goal.radius) continue;
    reached_[i] = true;
    last_goal_ = std::max(last_goal_, snapshot.time);
  }
  see_contacts(snapshot);
  if (hull_) see_clearance(snapshot);
}

void Judge::see_clearance(const Snapshot& snapshot) {
  const JudgeHull::Nearest nearest = hull_->nearest(snapshot, expected_.clearance_reach);
  smallest_clearance_m_ = std::min(smallest_clearance_m_, nearest.range);
  if (!expected_.clearance || nearest.range >= *expected_.clearance) return;
  fail("clearance", snapshot.time,
       fmt::format("{} was {:.3f} m from {}, at least {:g} m are asked for", expected_.robot,
                   nearest.range, name_of(nearest.link), *expected_.clearance));
}

void Judge::see_contacts(const Snapshot& snapshot) {
  for (const Contact& contact : snapshot.contacts) {
    if (!contact.link_a.valid() || !contact.link_b.valid() ||
        static_cast<size_t>(std::max(contact.link_a, contact.link_b)) >= own_.size())
      continue;
    const bool a = own_[contact.link_a], b = own_[contact.link_b];
    if (a == b) continue;
    // What carries it presses upwards on a wheel, or from below anywhere (castors).
    if (std::abs(contact.normal.z()) > 0.7 &&
        contact.position.z() < snapshot.robots[robot_].X_WBase.translation.z() + 0.02)
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
  const auto is = [&](const char* device) {
    return channel.size() == expected_.robot.size() + std::strlen(device) &&
           channel.starts_with(expected_.robot) && channel.ends_with(device);
  };
  if (is("/pose")) {
    pose_t pose;
    if (decode_checked(message.data(), message.size(), pose) != DecodeFault::none) return;
    if (!first_pose_) first_pose_ = pose;
    pose_ = pose;
  } else if (is("/odometry")) {
    odometry_t odometry;
    if (decode_checked(message.data(), message.size(), odometry) != DecodeFault::none) return;
    odometry_ = odometry;
  } else {
    return;
  }
  if (pose_ && odometry_ && pose_->utime == odometry_->utime) compare_odometry();
}

// Odometry starts at zero where the robot starts: the truth is looked at from its first pose.
void Judge::compare_odometry() {
  const double dx = pose_->pos[0] - first_pose_->pos[0], dy = pose_->pos[1] - first_pose_->pos[1],
               turn = heading_of(first_pose_->orientation);
  const double x = math::cos(turn) * dx + math::sin(turn) * dy,
               y = -math::sin(turn) * dx + math::cos(turn) * dy;
  const double error = math::hypot(odometry_->x - x, odometry_->y - y);
  odometry_error_m_ = std::max(odometry_error_m_, error);
  if (!expected_.odometry_error || error <= *expected_.odometry_error) return;
  fail("odometry", pose_->utime,
       fmt::format("{}'s odometry was {:.3f} m off, at most {:g} m are asked for", expected_.robot,
                   error, *expected_.odometry_error));
}

std::vector<Failure> Judge::failures() {
  for (size_t i = 0; i < expected_.goals.size(); ++i) {
    const Goal& goal = expected_.goals[i];
    if (reached_[i]) continue;
    fail(fmt::format("goal {}", i), microseconds(goal.by_s),
         fmt::format("{} was not within {:g} m of ({:g}, {:g}) by {:g} s{}", expected_.robot,
                     goal.radius, goal.x, goal.y, goal.by_s,
                     seconds(seen_) < goal.by_s
                         ? fmt::format("; the run ended at {:g} s", seconds(seen_))
                         : ""));
  }
  if (expected_.odometry_error && odometry_error_m_ < 0.0) {
    fail("odometry", 0,
         fmt::format("there is no {0}/odometry beside {0}/pose to judge by", expected_.robot));
  }
  std::stable_sort(failures_.begin(), failures_.end(),
                   [](const Failure& a, const Failure& b) { return a.time < b.time; });
  return failures_;
}

std::vector<Metric> Judge::metrics() const {
  std::vector<Metric> metrics{{"time_s", seconds(seen_)},
                              {"x_m", position_.x()},
                              {"y_m", position_.y()},
                              {"path_m", path_m_}};
  if (!expected_.goals.empty()) metrics.push_back({"goal_distance_m", last_goal_distance_m_});
  if (!reached_.empty() && std::find(reached_.begin(), reached_.end(), false) == reached_.end())
    metrics.push_back({"goal_time_s", seconds(last_goal_)});
  if (first_contact_ >= 0) metrics.push_back({"contact_time_s", seconds(first_contact_)});
  if (hull_)
    metrics.push_back({"clearance_m", std::min(smallest_clearance_m_, expected_.clearance_reach)});
  if (odometry_error_m_ >= 0.0) metrics.push_back({"odometry_error_m", odometry_error_m_});
  return metrics;
}

std::string to_line(const Failure& failure) {
  return fmt::format("{:.3f} s: {}", seconds(failure.time), failure.text);
}

}  // namespace ruedo::judge
