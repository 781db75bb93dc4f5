// Goals, contacts and odometry; clearance is in judge_hull.cpp.
#include "cli/judge.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "cli/judge_hull.h"
#include "core/whole.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/odometry_t.hpp"
#include "ruedo/pose_t.hpp"
#include "log/reader.h"

namespace ruedo::cli {
namespace {

double seconds(SimTime time) { return static_cast<double>(time) * 1e-6; }

// Of a quaternion w, x, y, z.
double heading_of(const double* q) { return std::atan2(2.0 * (q[0] * q[3] + q[1] * q[2]), 1.0 - 2.0 * (q[2] * q[2] + q[3] * q[3])); }

}  // namespace

Goal parse_goal(const std::string& text) {
  double numbers[4];
  size_t begin = 0;
  for (int i = 0; i < 4; ++i) {
    const size_t end = i == 3 ? text.size() : std::min(text.find(',', begin), text.size());
    const auto [stop, error] = std::from_chars(text.data() + begin, text.data() + end, numbers[i]);
    if (begin > text.size() || error != std::errc() || stop != text.data() + end || !std::isfinite(numbers[i]) || (i >= 2 && numbers[i] <= 0.0)) {
      throw InputError({}, "--goal '" + text + "': it looks like X,Y,RADIUS,BY (m, m, m above 0, s above 0), for example 3,2.5,0.2,60");
    }
    begin = end + 1;
  }
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

Judge::Judge(const model::WorldModel& world, Expectations expected) : world_(world), expected_(std::move(expected)), layout_(world) {
  std::vector<std::string> names;
  for (size_t i = 0; i < layout_.robots.size(); ++i) {
    const std::string& name = world.models[static_cast<size_t>(layout_.robots[i].instance)].name;
    names.push_back(name);
    if (robot_ < 0 && (expected_.robot.empty() || expected_.robot == name)) robot_ = static_cast<int>(i);
  }
  if (robot_ < 0) throw InputError({}, fmt::format("--robot '{}': the world has {}", expected_.robot, names.empty() ? "no robot" : fmt::format("{}", fmt::join(names, ", "))));
  expected_.robot = names[static_cast<size_t>(robot_)];
  const int instance = layout_.robots[static_cast<size_t>(robot_)].instance;
  own_.resize(layout_.links.size());
  wheel_.resize(layout_.links.size());
  for (size_t i = 0; i < layout_.links.size(); ++i) own_[i] = layout_.links[i].instance == instance;
  for (const model::WheelPlacement& wheel : layout_.wheels) wheel_[static_cast<size_t>(wheel.link)] = wheel.robot == robot_;
  reached_.resize(expected_.goals.size());
  if (expected_.clearance) hull_ = std::make_unique<JudgeHull>(world_, layout_, robot_);
}

Judge::~Judge() = default;

void Judge::fail(const std::string& what, SimTime time, const std::string& text) {
  const bool known = std::any_of(failures_.begin(), failures_.end(), [&](const Failure& f) { return f.what == what; });
  if (!known) failures_.push_back({what, time, text});
}

std::string Judge::name_of(int link) const {
  const model::LinkPlacement& placement = layout_.links[static_cast<size_t>(link)];
  const model::ModelInstance& instance = world_.models[static_cast<size_t>(placement.instance)];
  return instance.name + "/" + instance.model->links[static_cast<size_t>(placement.link)].name;
}

void Judge::see(const Snapshot& snapshot) {
  seen_ = snapshot.time;
  if (static_cast<size_t>(robot_) >= snapshot.robots.size()) return;
  const Vec3 position = snapshot.robots[static_cast<size_t>(robot_)].X_WBase.translation;
  for (size_t i = 0; i < expected_.goals.size(); ++i) {
    const Goal& goal = expected_.goals[i];
    if (seconds(snapshot.time) <= goal.by_s && std::hypot(position.x() - goal.x, position.y() - goal.y) <= goal.radius) reached_[i] = true;
  }
  if (expected_.no_contact) see_contacts(snapshot);
  if (hull_) {
    const JudgeHull::Nearest nearest = hull_->nearest(snapshot, *expected_.clearance);
    if (nearest.range < *expected_.clearance) {
      fail("clearance", snapshot.time, fmt::format("{} was {:.3f} m from {}, at least {:g} m are asked for", expected_.robot, nearest.range,
                                                   name_of(nearest.link), *expected_.clearance));
    }
  }
}

void Judge::see_contacts(const Snapshot& snapshot) {
  for (const Contact& contact : snapshot.contacts) {
    if (contact.link_a < 0 || contact.link_b < 0 || static_cast<size_t>(std::max(contact.link_a, contact.link_b)) >= own_.size()) continue;
    const bool a = own_[static_cast<size_t>(contact.link_a)], b = own_[static_cast<size_t>(contact.link_b)];
    if (a == b) continue;
    // What carries it presses upwards on a wheel, or from below anywhere (castors).
    if (std::abs(contact.normal.z()) > 0.7 && contact.position.z() < snapshot.robots[static_cast<size_t>(robot_)].X_WBase.translation.z() + 0.02) continue;
    fail("contact", snapshot.time, fmt::format("{} touched {} at ({:.3f}, {:.3f}, {:.3f})", name_of(a ? contact.link_a : contact.link_b),
                                               name_of(a ? contact.link_b : contact.link_a), contact.position.x(), contact.position.y(),
                                               contact.position.z()));
  }
}

// Odometry starts at zero where the robot starts: the truth is looked at from its first pose.
void Judge::check_odometry(const std::string& record) {
  log::Reader log(record);
  log::Event event;
  std::optional<pose_t> start, pose;
  bool compared = false;
  const std::string pose_channel = expected_.robot + "/pose", odometry_channel = expected_.robot + "/odometry";
  std::optional<odometry_t> odometry;
  while (log.next(event)) {
    pose_t new_pose;
    odometry_t new_odometry;
    if (event.channel == pose_channel && decode_checked(event.data.data(), event.data.size(), new_pose) == DecodeFault::none) {
      if (!start) start = new_pose;
      pose = new_pose;
    } else if (event.channel == odometry_channel && decode_checked(event.data.data(), event.data.size(), new_odometry) == DecodeFault::none) {
      odometry = new_odometry;
    } else {
      continue;
    }
    if (!pose || !odometry || pose->utime != odometry->utime) continue;
    compared = true;
    const double dx = pose->pos[0] - start->pos[0], dy = pose->pos[1] - start->pos[1], turn = heading_of(start->orientation);
    const double x = std::cos(turn) * dx + std::sin(turn) * dy, y = -std::sin(turn) * dx + std::cos(turn) * dy;
    const double error = std::hypot(odometry->x - x, odometry->y - y);
    if (error > *expected_.odometry_error) {
      return fail("odometry", pose->utime, fmt::format("{}'s odometry was {:.3f} m off, at most {:g} m are asked for", expected_.robot, error, *expected_.odometry_error));
    }
  }
  if (!compared) fail("odometry", 0, "there is no " + odometry_channel + " beside " + pose_channel + " to judge by");
}

std::vector<std::string> Judge::failures(const std::string& record) {
  for (size_t i = 0; i < expected_.goals.size(); ++i) {
    const Goal& goal = expected_.goals[i];
    if (reached_[i]) continue;
    fail(fmt::format("goal {}", i), microseconds(goal.by_s),
         fmt::format("{} was not within {:g} m of ({:g}, {:g}) by {:g} s{}", expected_.robot, goal.radius, goal.x, goal.y, goal.by_s,
                     seconds(seen_) < goal.by_s ? fmt::format("; the run ended at {:g} s", seconds(seen_)) : ""));
  }
  if (expected_.odometry_error) check_odometry(record);
  std::stable_sort(failures_.begin(), failures_.end(), [](const Failure& a, const Failure& b) { return a.time < b.time; });
  std::vector<std::string> lines;
  for (const Failure& failure : failures_) lines.push_back(fmt::format("{:.3f} s: {}", seconds(failure.time), failure.text));
  return lines;
}

}  // namespace ruedo::cli
