// The true pose of a robot's base_link, on ROBOT/pose: ground truth to measure errors against. No
// noise.
#include "ruedo/pose_t.hpp"
#include "ruedo/sensor.h"
#include "world/model/body_layout.h"

namespace ruedo {
namespace {

class TruePose : public SensorOf<TruePose> {
 public:
  explicit TruePose(const SensorSetup& setup)
      : robot_(setup.robot_index), channel_(setup.channel<pose_t>()) {}

  void sample(const SampleInput& input, Outbox& out) override {
    const RobotState& robot = input.snapshot.robots[robot_];
    pose_t message;
    message.utime = input.snapshot.time;
    const Quat& q = robot.X_WBase.rotation;
    const double orientation[4] = {q.w(), q.x(), q.y(), q.z()};
    for (int i = 0; i < 4; ++i) message.orientation[i] = orientation[i];
    for (int i = 0; i < 3; ++i) {
      message.pos[i] = robot.X_WBase.translation[i];
      message.vel[i] = robot.twist.linear[i];
      message.rotation_rate[i] = robot.twist.angular[i];
      message.accel[i] = robot.acceleration[i];
    }
    out.publish(channel_, message);
  }

  void exchange(StateArchive&) {}

 private:
  RobotIndex robot_;
  int channel_;
};

const RegisterSensor kRegister{
    {.module = "odometry",
     .order = 1,
     .types = {},
     .attach_to = "robot",
     .device_name = "pose",
     .default_rate = {50, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<TruePose>(setup); },
     .kind = "pose",
     .drive_rate = [](const world::DriveDescription& drive) { return drive.pose_rate; }}};

}  // namespace
}  // namespace ruedo
