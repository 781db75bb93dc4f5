// The true pose of a link, or of a frame on it, in the world, with noise on its velocities, on
// ROBOT/DEVICE: what Gazebo's plugins p3d and OdometryPublisher publish as odometry.
#include <cmath>

#include "ruedo/pose_t.hpp"
#include "sensors/mount.h"

namespace ruedo {
namespace {

std::array<std::string, 6> noise_paths() {
  const std::string velocity = "ruedo:pose/ruedo:velocity/noise",
                    turn_rate = "ruedo:pose/ruedo:turn_rate/noise";
  return {velocity, velocity, velocity, turn_rate, turn_rate, turn_rate};
}

class BodyPose : public SensorOf<BodyPose> {
 public:
  explicit BodyPose(const SensorSetup& setup)
      : mount_(setup), noises_(setup, noise_paths()), channel_(setup.channel<pose_t>()) {
    setup.element.refuse_unknown({"ruedo:phase", "ruedo:pose"});
    if (const Element* pose = setup.element.child("ruedo:pose"))
      pose->refuse_unknown({"ruedo:velocity", "ruedo:turn_rate", "ruedo:dimensions"});
    flat_ = setup.element.integer("ruedo:pose/ruedo:dimensions", 3, Allowed::between(2, 3)) == 2;
  }

  bool observes() const override { return true; }

  // The device's acceleration is the change of its velocity over the last step.
  void observe(const Snapshot& now, Outbox&) override {
    const Vec3 velocity = mount_.twist(now).linear;
    if (time_ >= 0 && now.time > time_)
      acceleration_ = (velocity - velocity_) / (1e-6 * static_cast<double>(now.time - time_));
    velocity_ = velocity;
    time_ = now.time;
  }

  void sample(const SampleInput& input, Outbox& out) override {
    const Snapshot& now = input.snapshot;
    Pose X_WS = mount_.pose(now);
    Twist twist = mount_.twist(now);
    Vec3 acceleration = acceleration_;
    if (flat_) {
      X_WS = Pose::from_xyz_rpy({X_WS.translation.x(), X_WS.translation.y(), 0},
                                {0, 0, heading(X_WS.rotation)});
      twist = {{twist.linear.x(), twist.linear.y(), 0}, {0, 0, twist.angular.z()}};
      acceleration.z() = 0;
    }
    const Quat R_SW = X_WS.rotation.conjugate();
    const Vec3 v = R_SW * twist.linear, omega = R_SW * twist.angular, a = R_SW * acceleration;
    const auto m = noises_.apply({v.x(), v.y(), v.z(), omega.x(), omega.y(), omega.z()}, now.time,
                                 input.sample);
    pose_t message;
    message.utime = now.time;
    const double wxyz[] = {X_WS.rotation.w(), X_WS.rotation.x(), X_WS.rotation.y(),
                           X_WS.rotation.z()};
    std::copy(std::begin(wxyz), std::end(wxyz), message.orientation);
    for (size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      message.pos[i] = X_WS.translation[axis];
      message.vel[i] = m[i];
      message.rotation_rate[i] = m[i + 3];
      message.accel[i] = a[axis];
    }
    out.publish(channel_, message);
  }

  void shift_time(SimTime us) override {
    noises_.shift_time(us);
    time_ -= us;
  }

  void exchange(StateArchive& archive) { archive(noises_, time_, velocity_, acceleration_); }

 private:
  Mount mount_;
  Noises<6> noises_;  // linear velocity, then angular velocity
  int channel_;
  bool flat_ = false;  // only x, y and heading
  SimTime time_ = -1;
  Vec3 velocity_ = Vec3::Zero(), acceleration_ = Vec3::Zero();  // world
};

const RegisterSensor kRegister{
    {.module = "instruments",
     .order = 7,
     .types = {"ruedo:pose"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {50, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<BodyPose>(setup); },
     .kind = "body_pose"}};

}  // namespace
}  // namespace ruedo
