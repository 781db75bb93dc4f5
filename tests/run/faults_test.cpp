// The cost of faults: kept messages are limited and dropped with them, and ended faults make room
// for others.
#include "engine/faults/faults.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include "engine/module.h"
#include "running.h"

namespace ruedo::run {
namespace {

using engine::FaultFilter;
using engine::SensorFault;
using testing::ElementsAre;
using testing::IsEmpty;
using Kind = SensorFault::Kind;

// A message of that size that says of which step it is.
struct Sized {
  int64_t step;
  int bytes;
  int getEncodedSize() const { return bytes; }
  int encode(void* to, int offset, int size) const {
    uint8_t* begin = static_cast<uint8_t*>(to) + offset;
    std::fill(begin, begin + size, uint8_t{0});
    begin[size - 1] = static_cast<uint8_t>(step);
    return size;
  }
};

SensorFault fault(Kind kind, int64_t id, int64_t begin, int64_t end, const char* device = "eye") {
  SensorFault made;
  made.id = id;
  made.kind = kind;
  made.robot = RobotIndex(0);
  made.device = device;
  made.begin = begin;
  made.end = end;
  made.lag_steps = 20;
  return made;
}

constexpr size_t kCost = 1000 + 128;  // of a message of 1000 bytes, with what is beside it

// The steps of the messages that leave at that one; on each channel one of 1000 bytes comes in.
std::vector<int> pass(FaultFilter& filter, const std::vector<SensorFault>& faults, int64_t step,
                      int channels = 1) {
  Outbox published, out;
  published.begin_step(step);
  for (int channel = 0; channel < channels; ++channel)
    published.publish(channel, Sized{step, 1000});
  filter.pass(published, faults, RobotIndex(0), "eye", step, out);
  std::vector<int> steps;
  for (const Outbox::Entry& entry : out.entries()) steps.push_back(out.data(entry)[entry.size - 1]);
  return steps;
}

TEST(FaultsKeep, NoMoreLaggingMessagesThanFit) {
  FaultFilter filter(5000, 3 * kCost);
  const std::vector<SensorFault> faults{fault(Kind::lag, 1, 0, 1000)};
  for (int64_t step = 0; step < 20; ++step) EXPECT_THAT(pass(filter, faults, step), IsEmpty());
  EXPECT_EQ(filter.kept(), 3 * kCost);
  // The first three were kept, and each that leaves makes room for one.
  EXPECT_THAT(pass(filter, faults, 20), ElementsAre(0));
  EXPECT_THAT(pass(filter, faults, 21), ElementsAre(1));
  EXPECT_THAT(pass(filter, faults, 22), ElementsAre(2));
  for (int64_t step = 23; step < 40; ++step) EXPECT_THAT(pass(filter, faults, step), IsEmpty());
  EXPECT_THAT(pass(filter, faults, 40), ElementsAre(20));
}

TEST(FaultsKeep, EqualShares) {
  FaultFilter filter(5000, 4 * kCost);
  const std::vector<SensorFault> faults{fault(Kind::lag, 1, 0, 1000),
                                        fault(Kind::freeze, 2, 10, 1000, "another")};
  for (int64_t step = 0; step < 10; ++step) pass(filter, faults, step);
  EXPECT_EQ(filter.kept(), 4 * kCost);
  pass(filter, faults, 10);
  EXPECT_EQ(filter.kept(), 2 * kCost);
}

TEST(FaultsKeep, FrozenMessagesThatHaveRoom) {
  FaultFilter filter(5000, 2 * kCost);
  const std::vector<SensorFault> faults{fault(Kind::freeze, 1, 7, 1000)};
  EXPECT_THAT(pass(filter, faults, 7, 3), ElementsAre(7, 7));
  EXPECT_THAT(pass(filter, faults, 8, 3), ElementsAre(7, 7));
  EXPECT_EQ(filter.kept(), 2 * kCost);
}

TEST(FaultsKeep, NoMessagesAfterTheirEnd) {
  FaultFilter filter(5000);
  const std::vector<SensorFault> faults{fault(Kind::freeze, 1, 0, 5), fault(Kind::lag, 2, 5, 10),
                                        fault(Kind::clock_drift, 3, 0, 1000)};
  EXPECT_THAT(pass(filter, faults, 0), ElementsAre(0));
  EXPECT_THAT(pass(filter, faults, 4), ElementsAre(0));
  EXPECT_EQ(filter.kept(), kCost);
  EXPECT_THAT(pass(filter, faults, 5), IsEmpty());
  EXPECT_THAT(pass(filter, faults, 9), IsEmpty());
  EXPECT_EQ(filter.kept(), 2 * kCost);
  EXPECT_THAT(pass(filter, faults, 10), ElementsAre(10));
  EXPECT_EQ(filter.kept(), 0);
}

constexpr int kLarge = 64 << 20;

class LargeSensor : public Sensor {
 public:
  void sample(const SampleInput& input, Outbox& out) override {
    out.publish(0, Sized{input.snapshot.step, kLarge});
  }
};

// Also where the device is not faulty any more, and so has no filter.
TEST(FaultsKeep, NothingInAModule) {
  engine::ModuleSetup setup;
  setup.devices.push_back({std::make_unique<LargeSensor>(), {0, 1}});
  setup.devices[0].robot = RobotIndex(0);
  setup.devices[0].name = "eye";
  engine::Module module(std::move(setup));
  const auto in_use = [] {
    const struct mallinfo2 now = mallinfo2();
    return now.uordblks + now.hblkhd;
  };
  const size_t before = in_use();
  for (int64_t step = 0; step < 3; ++step) {
    engine::Batch batch;
    batch.first_step = step;
    batch.count = 1;
    batch.snapshots.resize(1);
    batch.snapshots[0].step = step;
    batch.sensor_faults = std::make_shared<std::vector<SensorFault>>(
        std::vector<SensorFault>{fault(Kind::freeze, 1, 0, 2)});
    engine::Batch::Output output;
    output.pieces.resize(1);
    module.process(batch, output, false);
    EXPECT_EQ(output.pieces[0].entries().size(), 1u);
  }
  EXPECT_LT(in_use() - before, kLarge / 2);
}

TEST(ModuleOfFaultyDevices, LooksAtEachStepWhileItHasOne) {
  engine::ModuleSetup setup;
  setup.devices.push_back({std::make_unique<LargeSensor>(), {0, 1}});
  setup.devices[0].robot = RobotIndex(0);
  setup.devices[0].name = "eye";
  setup.devices[0].first_step = 100;  // its first sample
  const engine::Module module(std::move(setup));
  engine::Batch batch;
  const auto wants = [&](const char* device, int64_t first_step) {
    batch.sensor_faults = std::make_shared<std::vector<SensorFault>>(
        std::vector<SensorFault>{fault(Kind::lag, 1, 5, 8, device)});
    batch.first_step = first_step;
    batch.count = 2;
    return module.wants(batch);
  };
  EXPECT_FALSE(wants("eye", 3));  // steps 3 and 4
  EXPECT_TRUE(wants("eye", 4));
  EXPECT_TRUE(wants("eye", 7));
  EXPECT_FALSE(wants("eye", 8));
  EXPECT_FALSE(wants("ear", 5));
}

class FaultsTest : public testing::Test {
 protected:
  static std::vector<device_info_t> one_device() {
    device_info_t device;
    device.robot = "r";
    device.name = "odometry";
    device.kind = "odometry";
    return {device};
  }
  static world::Fault made(const char* kind, const char* target, double duration_s, double value) {
    world::Fault fault;
    fault.kind = kind;
    fault.target = target;
    fault.duration_s = duration_s;
    fault.value = value;
    return fault;
  }
  bool takes(const world::Fault& fault) const { return faults_.check(fault, RobotIndex(0)) == ""; }
  void begin(const world::Fault& fault, int64_t step) { faults_.begin(fault, RobotIndex(0), step); }

  std::shared_ptr<const world::WorldModel> world_ = load_text(robot_sdf("r", 0, 0));
  world::BodyLayout layout_{*world_};
  physics::PhysicsWorld physics_{*world_, layout_};
  robot::Robots robots_{*world_, layout_, physics_};
  std::vector<device_info_t> devices_ = one_device();
  engine::Faults faults_{*world_, layout_, devices_, 1};
};

constexpr double kStep_s = 0.005;

// Of sensors: the list that a batch gets has those that act on any of its steps.
TEST_F(FaultsTest, EndedSensorFaultsFreeTheirPlace) {
  const world::Fault short_one = made("dropout", "odometry", kStep_s, 0.0);
  for (int64_t step = 0; step < 3000; ++step) {
    ASSERT_TRUE(takes(short_one)) << step;
    begin(short_one, step);  // of the state step + 1
    const std::vector<SensorFault>& now = *faults_.of_sensors();
    EXPECT_EQ(now.back().begin, step + 1);
    EXPECT_EQ(now.front().begin, std::max<int64_t>(1, step - engine::kMaxBatchSteps));
  }
  EXPECT_FALSE(faults_.none());
}

TEST_F(FaultsTest, EndedRobotFaultsFreeTheirPlace) {
  const world::Fault weak = made("weak_motor", "", kStep_s, 0.5),
                     kidnapped = made("kidnapped", "", 0.0, 0.0);
  for (int64_t step = 0; step < 3000; ++step) {
    const world::Fault& fault = step % 2 == 0 ? weak : kidnapped;
    ASSERT_TRUE(takes(fault)) << step;
    begin(fault, step);
    faults_.before_commands(step, robots_);
  }
  EXPECT_FALSE(faults_.none());
}

TEST_F(FaultsTest, OtherSeedsMakeRoomWhenTheyHaveActed) {
  for (int64_t step = 0; step < 3000; ++step) {
    ASSERT_EQ(faults_.new_seed(step), step == 0 ? std::nullopt : std::optional<uint64_t>(step + 9));
    const world::Fault fault = made("reseeded", "", 0.0, static_cast<double>(step + 10));
    ASSERT_TRUE(takes(fault)) << step;
    begin(fault, step);
    // A batch of this step may have begun so early.
    const int64_t first = std::max<int64_t>(1, step + 1 - engine::kMaxBatchSteps);
    ASSERT_EQ(engine::reseeding_at(*faults_.reseedings(), first)->seed, first + 9u);
  }
}

TEST_F(FaultsTest, LimitsSimultaneousFaults) {
  const world::Fault weak = made("weak_motor", "", 0.0, 0.5),
                     dropout = made("dropout", "odometry", 1e6, 0.0);
  for (int i = 0; i < 500; ++i) {
    begin(weak, 0);
    begin(dropout, 0);
  }
  EXPECT_EQ(faults_.check(weak, RobotIndex(0)), "there are 1000 faults already");
  begin(weak, 100);
  EXPECT_EQ(faults_.check(weak, RobotIndex(0)), "there are 1000 faults already");
}

// Whatever numbers a message of the bus has: it is accepted or ignored, and the run continues.
TEST_F(FaultsTest, NoNumberOfAMessageEndsTheRun) {
  const double odd[] = {1e300, -1e300, 1e15, -1.0, std::nan(""), HUGE_VAL, -HUGE_VAL, 5e-324};
  double world::Fault::* const fields[] = {
      &world::Fault::duration_s, &world::Fault::value, &world::Fault::from,   &world::Fault::to,
      &world::Fault::x,          &world::Fault::y,     &world::Fault::heading};
  for (const world::FaultKind& kind : world::fault_kinds()) {
    const bool of_device = kind.of == world::FaultKind::Of::device;
    for (double world::Fault::* const field : fields) {
      for (const double number : odd) {
        world::Fault fault = made(kind.name.c_str(), of_device ? "odometry" : "", 0.0, kind.most);
        fault.*field = number;
        EXPECT_NO_THROW(begin(fault, 0)) << kind.name << " " << number;
      }
    }
  }
  faults_.before_commands(1, robots_);
  EXPECT_NO_THROW(robots_.step());
}

TEST_F(FaultsTest, RefusesAValueWhereNoneIsAllowed) {
  EXPECT_TRUE(takes(made("freeze", "odometry", 0.0, 0.0)));
  EXPECT_EQ(faults_.check(made("freeze", "odometry", 0.0, 2.5), RobotIndex(0)),
            "value 2.5 of freeze is not allowed; it takes none");
}

// 32 MB of commands wait: of messages of 1 MB the first 32 act, and the last of these counts.
TEST_F(FaultsTest, LateCommandsAreBoundedInBytes) {
  begin(made("commands_late", "", 0.0, 100 * kStep_s), 0);
  for (int i = 1; i <= 40; ++i) {
    const robot::Command command{RobotIndex(0), robot::VelocityCommand{0.01 * i, 0.0, 0.0}};
    faults_.command(command, 1 << 20, 1, robots_);
  }
  faults_.before_commands(101, robots_);
  robots_.step();
  Snapshot snapshot;
  robots_.read(snapshot);
  EXPECT_NEAR(snapshot.robots[RobotIndex(0)].wheel_v, 0.32, 1e-9);
}

}  // namespace
}  // namespace ruedo::run
