// A robot's joints other than fixed ones and wheels of its drive, on ROBOT/joints: positions,
// velocities and motor efforts, without noise.
#include "ruedo/joint_state_t.hpp"
#include "ruedo/sensor.h"
#include "world/model/body_layout.h"

namespace ruedo {
namespace {

class Joints : public SensorOf<Joints> {
 public:
  explicit Joints(const SensorSetup& setup) : channel_(setup.channel<joint_state_t>()) {
    const world::RobotPlacement& robot = setup.layout.robots[setup.robot_index];
    const world::Model& model = *setup.world.models[robot.instance].model;
    joints_ = robot.joints;
    for (const JointIndex joint : joints_) {
      message_.joint_name.push_back(model.joints[setup.layout.joints[joint].joint].name);
    }
    message_.num_joints = static_cast<int16_t>(joints_.size());
    message_.joint_position.resize(joints_.size());
    message_.joint_velocity.resize(joints_.size());
    message_.joint_effort.resize(joints_.size());
  }

  void sample(const SampleInput& input, Outbox& out) override {
    message_.utime = input.snapshot.time;
    for (size_t i = 0; i < joints_.size(); ++i) {
      const JointIndex joint = joints_[i];
      message_.joint_position[i] = static_cast<float>(input.snapshot.joint_positions[joint]);
      message_.joint_velocity[i] = static_cast<float>(input.snapshot.joint_velocities[joint]);
      message_.joint_effort[i] = static_cast<float>(input.snapshot.joint_efforts[joint]);
    }
    out.publish(channel_, message_);
  }

  void exchange(StateArchive&) {}

 private:
  int channel_;
  std::vector<JointIndex> joints_;
  joint_state_t message_;
};

const RegisterSensor kRegister{
    {.module = "odometry",
     .order = 1,
     .types = {},
     .attach_to = "joints",
     .device_name = "joints",
     .default_rate = {50, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<Joints>(setup); },
     .kind = "joints"}};

}  // namespace
}  // namespace ruedo
