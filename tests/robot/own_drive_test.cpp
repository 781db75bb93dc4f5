// Plugin drives in snapshots: they define how they are copied, or are refused by name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ruedo/drive.h"
#include "ruedo/errors.h"
#include "sim.h"

namespace ruedo::robot::testing {
namespace {

using ::testing::HasSubstr;

// In each step a little faster than commanded: it has a state of its own.
class Growing : public DriveModel {
 public:
  BaseVelocity step(const DriveInput& input) override {
    BaseVelocity made = input.asked;
    made.ahead *= 1.0 + 0.001 * static_cast<double>(++steps_);
    return made;
  }

 protected:
  int steps_ = 0;
};

class Copied : public Growing {
 public:
  bool copy_from(const DriveModel& other) override {
    *this = static_cast<const Copied&>(other);
    return true;
  }
};

template <class Drive>
DriveKind kind(const char* type) {
  return {.type = type, .make = [](const DriveSetup&) { return std::make_unique<Drive>(); }};
}
const RegisterDrive kGrowing{kind<Growing>("test_growing")};
const RegisterDrive kCopied{kind<Copied>("test_copied")};

std::string world_of(const char* type) {
  return plane_sdf() + robot_sdf("rover", "0 0 0 0 0 0", "", type);
}

TEST(OwnDrive, ReportsADriveThatCannotBeCopied) {
  Sim sim(world_of("test_growing")), other(world_of("test_growing"));
  sim.velocity(0.3, 0.0);
  sim.run(0.5);
  try {
    other.robots.copy_from(sim.robots);
    FAIL() << "it was taken";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("the drive of robot 'rover' is a plugin's that cannot be "
                                        "copied: it lacks DriveModel::copy_from()"));
  }
  const Vec3 before = sim.position();
  sim.velocity(0.3, 0.0);
  sim.run(0.5);  // the original continues
  EXPECT_GT(sim.position().x(), before.x() + 0.1);
}

TEST(OwnDrive, ACopyContinuesEqually) {
  Sim sim(world_of("test_copied")), other(world_of("test_copied"));
  sim.velocity(0.3, 0.2);
  sim.run(0.5);
  other.physics.copy_from(sim.physics);
  other.robots.copy_from(sim.robots);
  sim.run(0.4);
  other.run(0.4);
  EXPECT_GT(sim.position().x(), 0.15);
  EXPECT_EQ(sim.position(), other.position());
  EXPECT_EQ(sim.yaw(), other.yaw());
}

}  // namespace
}  // namespace ruedo::robot::testing
