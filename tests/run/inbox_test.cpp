// Commands for future steps: each acts on exactly its step, in a fixed order, within bounds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "engine/command_inbox.h"
#include "ruedo/move_command_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/wheel_command_t.hpp"
#include "run/requests/control.h"
#include "running.h"

namespace ruedo::run {
namespace {

using testing::ElementsAre;
using Scheduled = engine::CommandInbox::Scheduled;

std::vector<uint8_t> velocity(double vx) {
  velocity_command_t command{};
  command.vx = vx;
  return engine::encoded(command);
}

class InboxTest : public testing::Test {
 protected:
  Scheduled schedule(int64_t step, double vx) {
    const auto bytes = velocity(vx);
    return inbox_.schedule(step, engine::InputIndex(0), bytes.data(), bytes.size());
  }
  void receive(double vx) {
    const auto bytes = velocity(vx);
    inbox_.put("r/velocity", bytes.data(), bytes.size());
  }
  // The speeds of the commands that act on that state, in their order.
  std::vector<double> apply(int64_t step) {
    batch_.applied_count = 0;
    inbox_.apply(robots_, faults_, step, batch_);
    std::vector<double> speeds;
    for (int i = 0; i < batch_.applied_count; ++i) {
      const engine::AppliedCommand& applied = batch_.applied[i];
      EXPECT_EQ(applied.step, step);
      velocity_command_t command{};
      EXPECT_GT(command.decode(applied.bytes.data(), 0, static_cast<int>(applied.bytes.size())), 0);
      speeds.push_back(command.vx);
    }
    return speeds;
  }

  std::shared_ptr<const world::WorldModel> world_ = load_text(robot_sdf("r", 0, 0));
  world::BodyLayout layout_{*world_};
  physics::PhysicsWorld physics_{*world_, layout_};
  robot::Robots robots_{*world_, layout_, physics_};
  std::vector<device_info_t> devices_;
  engine::Faults faults_{*world_, layout_, devices_, 1};
  engine::CommandInbox inbox_{{{"r/velocity", RobotIndex(0), engine::Input::Kind::velocity}}, 1};
  engine::Batch batch_;
};

TEST_F(InboxTest, ActsOnItsStepAndOnNoOther) {
  EXPECT_EQ(schedule(3, 0.3), Scheduled::kept);
  EXPECT_EQ(schedule(1, 0.1), Scheduled::kept);
  EXPECT_THAT(apply(0), ElementsAre());
  EXPECT_THAT(apply(1), ElementsAre(0.1));
  EXPECT_THAT(apply(2), ElementsAre());
  EXPECT_THAT(apply(3), ElementsAre(0.3));
  EXPECT_THAT(apply(4), ElementsAre());
}

TEST_F(InboxTest, BeforeLiveOnesInTheOrderOfScheduling) {
  receive(1.0);
  for (const double vx : {0.1, 0.2, 0.3, 0.4, 0.5, 0.6})
    EXPECT_EQ(schedule(0, vx), Scheduled::kept);  // more than live ones are kept
  receive(2.0);
  EXPECT_THAT(apply(0), ElementsAre(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 1.0, 2.0));
}

TEST_F(InboxTest, RefusesLateAndMalformedCommands) {
  apply(0);
  apply(1);
  EXPECT_EQ(schedule(1, 0.1), Scheduled::late);
  EXPECT_EQ(schedule(-1, 0.1), Scheduled::late);
  const auto bytes = velocity(0.1);
  EXPECT_EQ(inbox_.schedule(5, engine::InputIndex(1), bytes.data(), bytes.size()),
            Scheduled::faulty);
  EXPECT_EQ(inbox_.schedule(5, engine::InputIndex(-1), bytes.data(), bytes.size()),
            Scheduled::faulty);
  EXPECT_EQ(inbox_.schedule(5, engine::InputIndex(0), bytes.data(), bytes.size() - 1),
            Scheduled::faulty);
  EXPECT_EQ(inbox_.schedule(5, engine::InputIndex(0), nullptr, 0), Scheduled::faulty);
  for (int64_t step = 2; step < 7; ++step) EXPECT_THAT(apply(step), ElementsAre());
}

TEST_F(InboxTest, IsBounded) {
  for (size_t i = 0; i < engine::CommandInbox::kMostScheduled; ++i)
    ASSERT_EQ(schedule(static_cast<int64_t>(i % 2), 0.1), Scheduled::kept);
  EXPECT_EQ(schedule(0, 0.1), Scheduled::full);
  EXPECT_EQ(apply(0).size(), engine::CommandInbox::kMostScheduled / 2);
  EXPECT_EQ(schedule(1, 0.2), Scheduled::kept);  // there is room again
  EXPECT_EQ(apply(1).back(), 0.2);
}

TEST_F(InboxTest, RefusesLargeMessages) {
  engine::CommandInbox wheels({{"r/wheels", RobotIndex(0), engine::Input::Kind::wheels}}, 1);
  wheel_command_t command{};
  command.n = 8000;
  for (const uint64_t refused : {0, 1}) {
    command.rate.resize(static_cast<size_t>(command.n));
    const auto bytes = engine::encoded(command);
    wheels.put("r/wheels", bytes.data(), bytes.size());
    EXPECT_EQ(wheels.refused(), refused) << bytes.size();
    command.n = 8200;  // more than 64 kB
  }
}

TEST_F(InboxTest, RemovingARobotDropsItsCommands) {
  EXPECT_EQ(schedule(3, 0.3), Scheduled::kept);
  receive(0.1);
  inbox_.remove(RobotIndex(0));
  for (int64_t step = 0; step < 5; ++step) EXPECT_THAT(apply(step), ElementsAre()) << step;
}

// However threads are scheduled, each kept command acts once, on its step.
TEST_F(InboxTest, ARepeatedPrimitiveRunsOnce) {
  engine::CommandInbox inbox({{"r/move", RobotIndex(0), engine::Input::Kind::move}}, 1);
  const auto moved = [&](int64_t id, double value) {
    move_command_t command{};
    command.id = id;
    command.kind = move_command_t::ADVANCE;
    command.value = value;
    const auto bytes = engine::encoded(command);
    inbox.put("r/move", bytes.data(), bytes.size());
  };
  const auto applied = [&](int64_t step) {
    batch_.applied_count = 0;
    inbox.apply(robots_, faults_, step, batch_);
    return batch_.applied_count;
  };
  moved(7, 1.0);
  moved(7, 1.0);
  EXPECT_EQ(applied(0), 1);
  moved(7, 1.0);  // late
  EXPECT_EQ(applied(1), 0);
  moved(8, 1.0);
  moved(8, 2.0);  // another one, though its number is not
  EXPECT_EQ(applied(2), 2);
  moved(7, 1.0);  // the network has exchanged the two
  EXPECT_EQ(applied(3), 0);
  moved(0, 1.0);
  moved(0, 1.0);  // without a number each one counts
  EXPECT_EQ(applied(4), 2);
  EXPECT_EQ(inbox.refused(), 0u);
}

TEST_F(InboxTest, ManyThreads) {
  std::atomic<int> kept{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 2000; ++i)
        kept += schedule((i * 7 + t) % 500, 0.001 * ((i * 7 + t) % 500)) == Scheduled::kept;
    });
  }
  size_t applied = 0;
  for (int64_t step = 0; step < 500; ++step) {
    for (const double vx : apply(step)) {
      EXPECT_DOUBLE_EQ(vx, 0.001 * static_cast<double>(step));
      ++applied;
    }
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(applied, static_cast<size_t>(kept));
}

}  // namespace
}  // namespace ruedo::run
