// Sums find non-finite values: one infinity or NaN makes the sum non-finite, and the values added
// here are far below the largest double.
#include "physics/state_check.h"

#include <cmath>

#include "base/text.h"
#include "world/read/read_context.h"

namespace ruedo::physics {

namespace {

bool finite(const Pose& X) {
  return std::isfinite(X.translation.sum() + X.rotation.coeffs().sum());
}
bool finite(const Twist& twist) { return std::isfinite(twist.linear.sum() + twist.angular.sum()); }

[[noreturn]] void fail(const Snapshot& snapshot, const std::string& what) {
  throw StateError("at " + shown(static_cast<double>(snapshot.time) * 1e-6) + " s the state of " +
                   what +
                   " is not finite: the run ends with the step before. Masses, inertias and "
                   "efforts that do not fit each other do this");
}

std::string joint_name(size_t joint, const world::WorldModel& world,
                       const world::BodyLayout& layout) {
  const auto& placed = layout.joints[joint];
  const world::ModelInstance& instance = world.models[placed.instance];
  return "the joint '" + instance.name + "/" + instance.model->joints[placed.joint].name + "'";
}

}  // namespace

void check_finite(const Snapshot& snapshot, const world::WorldModel& world,
                  const world::BodyLayout& layout) {
  for (const BodyIndex i : snapshot.moving) {
    const Vec3& acceleration = snapshot.body_accelerations[i];
    if (!finite(snapshot.bodies[i]) || !finite(snapshot.body_twists[i]) ||
        !std::isfinite(acceleration.sum())) {
      fail(snapshot, "the body '" + layout.bodies[i].name + "'");
    }
  }
  for (size_t i = 0; i < snapshot.joint_positions.size(); ++i) {
    if (!std::isfinite(snapshot.joint_positions[i] + snapshot.joint_velocities[i] +
                       snapshot.joint_efforts[i]))
      fail(snapshot, joint_name(i, world, layout));
  }
  for (size_t i = 0; i < snapshot.robots.size(); ++i) {
    const RobotState& robot = snapshot.robots[i];
    const bool good = finite(robot.X_WBase) && finite(robot.twist) &&
                      std::isfinite(robot.acceleration.sum() + robot.wheel_v + robot.wheel_omega +
                                    robot.motion.done + robot.motion.remaining);
    if (!good) fail(snapshot, "the robot '" + world.models[layout.robots[i].instance].name + "'");
  }
  for (size_t i = 0; i < snapshot.wheel_angles.size(); ++i) {
    if (!std::isfinite(snapshot.wheel_angles[i] + snapshot.wheel_rates[i]))
      fail(snapshot, "wheel " + std::to_string(i));
  }
  for (const Contact& contact : snapshot.contacts.moving()) {
    if (!std::isfinite(contact.position.sum() + contact.normal.sum() + contact.force +
                       contact.depth)) {
      const BodyIndex body = contact.body_a.valid() ? contact.body_a : contact.body_b;
      fail(snapshot, "a contact of the body '" +
                         (body.valid() ? layout.bodies[body].name : std::string()) + "'");
    }
  }
}

}  // namespace ruedo::physics
