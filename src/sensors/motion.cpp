// The motion that a robot executes, on ROBOT/motion: at the drive's status rate, and at once when a
// command or primitive starts, ends or is refused. The last message of a step has the current
// state; ends and refusals precede it.
#include <algorithm>

#include "ruedo/motion_status_t.hpp"
#include "ruedo/sensor.h"
#include "world/model/body_layout.h"

namespace ruedo {
namespace {

class MotionStatus : public SensorOf<MotionStatus> {
 public:
  explicit MotionStatus(const SensorSetup& setup)
      : robot_(setup.robot_index), channel_(setup.channel<motion_status_t>()) {}

  bool observes() const override { return true; }

  void observe(const Snapshot& now, Outbox& out) override {
    const MotionState& motion = now.robots[robot_].motion;
    if (motion.changes == changes_) return;
    changes_ = motion.changes;
    const auto ends =
        std::equal_range(now.motion_ends.begin(), now.motion_ends.end(), MotionEnd{robot_, {}},
                         [](const MotionEnd& a, const MotionEnd& b) { return a.robot < b.robot; });
    for (auto end = ends.first; end != ends.second; ++end) publish(now, end->state, out);
    if (now.step > 0) show(now, out);  // the initial state is a sample anyway
  }

  void shift_time(SimTime) override { shown_step_ = -1; }

  void sample(const SampleInput& input, Outbox& out) override {
    if (input.snapshot.step != shown_step_) show(input.snapshot, out);
  }

  void exchange(StateArchive& archive) { archive(changes_, shown_step_); }

 private:
  void show(const Snapshot& now, Outbox& out) {
    shown_step_ = now.step;
    publish(now, now.robots[robot_].motion, out);
  }

  void publish(const Snapshot& now, const MotionState& motion, Outbox& out) {
    const RobotState& robot = now.robots[robot_];
    motion_status_t message;
    message.utime = now.time;
    message.id = motion.id;
    message.kind = motion.kind;
    message.state = motion.state;
    message.reason = motion.reason;
    message.done = motion.done;
    message.remaining = motion.remaining;
    message.v = robot.twist.linear.x();
    message.omega = robot.twist.angular.z();
    out.publish(channel_, message);
  }

  RobotIndex robot_;
  int channel_;
  int64_t changes_ = 0;
  int64_t shown_step_ = -1;
};

const RegisterSensor kRegister{
    {.module = "odometry",
     .order = 1,
     .types = {},
     .attach_to = "drive",
     .device_name = "motion",
     .default_rate = {10, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<MotionStatus>(setup); },
     .kind = "motion",
     .drive_rate = [](const world::DriveDescription& drive) { return drive.status_rate; }}};

}  // namespace
}  // namespace ruedo
