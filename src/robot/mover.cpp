// Converts waypoints to poses. Times are whole microseconds, so that a loop repeats exactly.
#include "robot/mover.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/whole.h"
#include "robot/surroundings.h"

namespace ruedo::robot {

namespace {
constexpr double kJump_m_s = 1000.0;  // faster than anything moves
}  // namespace

Mover::Mover(const world::WorldModel& world, const world::BodyLayout& layout,
             physics::PhysicsWorld& physics, InstanceIndex instance)
    : physics_(physics), instance_(instance), step_us_(world.step_us) {
  const auto& placed = world.models[instance];
  path_ = read(*placed.model->path);
  for (const BodyIndex i : layout.bodies.indices()) {
    if (layout.bodies[i].instance != instance) continue;
    parts_.push_back({i, placed.X_WM.inverse() * layout.bodies[i].X_WB});
  }
  reset(0);
}

void Mover::reset(SimTime now) {
  offset_ = -now;
  const Pose X_WM = pose_at(0);
  for (const Part& part : parts_) physics_->set_pose(part.body, (X_WM * part.X_MB).normalized());
}

void check_path(const Element& path) {
  if (path.name == "ruedo:belt") return check_belt(path);
  if (path.name == "ruedo:door") return check_door(path);
  Mover::read(path);
}

Mover::Path Mover::read(const Element& path) {
  Path result;
  std::vector<Waypoint>& waypoints = result.waypoints;
  const bool ours = path.name.starts_with("ruedo:");
  result.loop = path.boolean(ours ? "ruedo:loop" : "loop", true);
  const auto add = [&waypoints](const Element& element, double time_s, const Pose& pose) {
    if (time_s < 0.0 || time_s > quantity::kTime.most)
      element.fail(fmt::format("the time {} is not within 0 and 1e9 s", time_s));
    const auto time = microseconds(time_s);
    if (!waypoints.empty() && time <= waypoints.back().time)
      element.fail("its time is not after the one before");
    waypoints.push_back({time, pose});
  };
  if (ours) {
    for (const Element* waypoint : path.all("ruedo:waypoint")) {
      const std::vector<double> v = waypoint->as_numbers(Allowed::any(quantity::kTime));
      if (v.size() != 7)
        waypoint->fail("has " + std::to_string(v.size()) +
                       " numbers, needs time x y z roll pitch yaw");
      for (size_t i = 1; i < v.size(); ++i) {
        if (std::abs(v[i]) > quantity::kLength.most)
          waypoint->fail("'" + waypoint->text +
                         "' leads too far; allowed is up to 1000000 m or rad");
      }
      add(*waypoint, v[0], Pose::from_xyz_rpy({v[1], v[2], v[3]}, {v[4], v[5], v[6]}));
    }
  } else {
    const Element* trajectory = path.name == "trajectory" ? &path : path.child("trajectory");
    for (const Element* waypoint :
         trajectory ? trajectory->all("waypoint") : std::vector<const Element*>{}) {
      add(*waypoint, waypoint->number("time", 0.0, Allowed::not_negative(quantity::kTime)),
          waypoint->pose("pose"));
    }
  }
  if (waypoints.empty()) path.fail("has no waypoint");
  return result;
}

Pose Mover::pose_at(SimTime time) const {
  const std::vector<Waypoint>& waypoints = path_.waypoints;
  const SimTime first = waypoints.front().time, last = waypoints.back().time;
  if (path_.loop && time > last && last > first) time = first + (time - first) % (last - first);
  if (time <= first) return waypoints.front().X_WM;
  if (time >= last) return waypoints.back().X_WM;
  const auto next =
      std::upper_bound(waypoints.begin(), waypoints.end(), time,
                       [](SimTime t, const Waypoint& waypoint) { return t < waypoint.time; });
  const Waypoint& from = *(next - 1);
  const double part =
      static_cast<double>(time - from.time) / static_cast<double>(next->time - from.time);
  return {from.X_WM.rotation.slerp(part, next->X_WM.rotation),
          from.X_WM.translation + part * (next->X_WM.translation - from.X_WM.translation)};
}

void Mover::before_step(SimTime now) {
  const Pose X_WM = pose_at(now + offset_ + step_us_);
  const double step_s = static_cast<double>(step_us_) * 1e-6;
  for (const Part& part : parts_) {
    const Pose end = (X_WM * part.X_MB).normalized();
    const Pose& begin = physics_->pose(part.body);
    const Eigen::AngleAxisd turn(end.rotation * begin.rotation.conjugate());
    Twist mean{(end.translation - begin.translation) / step_s,
               turn.axis() * (turn.angle() / step_s)};
    // the jump to the start of a loop: it hits nothing
    if (mean.linear.norm() > kJump_m_s) mean = {};
    physics_->guide(part.body, mean, end);
  }
}

}  // namespace ruedo::robot
