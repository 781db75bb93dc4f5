// What a robot is executing, on ROBOT/motion: at the drive's status rate, and at once when a command or a
// primitive begins, ends or is refused.
#include "model/body_layout.h"
#include "ruedo/motion_status_t.hpp"
#include "ruedo/sensor.h"

namespace ruedo {
namespace {

class MotionStatus : public Sensor {
 public:
  explicit MotionStatus(const SensorSetup& setup) : robot_(setup.robot_index), channel_(setup.channel<motion_status_t>()) {}

  bool observes() const override { return true; }

  void observe(const Snapshot& now, Outbox& out) override {
    const int64_t changes = now.robots[static_cast<size_t>(robot_)].motion.changes;
    if (changes == changes_) return;
    changes_ = changes;
    if (now.step > 0) publish(now, out);    // the initial state is a sample anyway
  }

  void sample(const SampleInput& input, Outbox& out) override {
    if (input.snapshot.step != published_step_) publish(input.snapshot, out);
  }

 private:
  void publish(const Snapshot& now, Outbox& out) {
    published_step_ = now.step;
    const RobotState& robot = now.robots[static_cast<size_t>(robot_)];
    motion_status_t message;
    message.utime = now.time;
    message.id = robot.motion.id;
    message.kind = robot.motion.kind;
    message.state = robot.motion.state;
    message.reason = robot.motion.reason;
    message.done = robot.motion.done;
    message.remaining = robot.motion.remaining;
    message.v = robot.twist.linear.x();
    message.omega = robot.twist.angular.z();
    out.publish(channel_, message);
  }

  int robot_;
  int channel_;
  int64_t changes_ = 0;
  int64_t published_step_ = -1;
};

const RegisterSensor kRegister{{.module = "odometry",
                                .order = 1,
                                .types = {},
                                .attach_to = "drive",
                                .device_name = "motion",
                                .default_rate = {10, 1},
                                .make = [](const SensorSetup& setup) { return std::make_unique<MotionStatus>(setup); },
                                .kind = "motion",
                                .drive_rate = [](const model::DriveDescription& drive) { return drive.status_rate; }}};

}  // namespace
}  // namespace ruedo
