// Where a robot says it is: its state, ROBOT/pose, the pose of its base_link, odometry and what the
// console draws (world_state_t) are one thing, at each step and on both drives, for our own robots
// and for each public one that lies beside the checkout. The frames of /tf are made of odometry_t
// (tests/bridges/ros2/test_links.py).
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/engine.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/odometry_t.hpp"
#include "ruedo/pose_t.hpp"
#include "ruedo/world_state_t.hpp"
#include "world/load.h"

namespace ruedo {
namespace {

using Kind = world::DriveDescription::Kind;
namespace fs = std::filesystem;

std::shared_ptr<const world::WorldModel> with_drive(const world::WorldModel& loaded, Kind kind) {
  auto world = std::make_shared<world::WorldModel>(loaded);
  for (world::ModelInstance& instance : world->models) {
    if (!instance.model->drive) continue;
    auto model = std::make_shared<world::Model>(*instance.model);
    model->drive->kind = kind;
    model->sensors.clear();  // what they see takes time, and moves nothing
    instance.model = model;
  }
  return world;
}

// base_link, or the robot's first link in a model that has none.
LinkIndex base_link(const world::WorldModel& world, const world::BodyLayout& layout) {
  LinkIndex first;
  if (layout.robots.empty()) return first;
  for (const LinkIndex link : layout.links.indices()) {
    const world::LinkPlacement& placed = layout.links[link];
    if (placed.instance != layout.robots[RobotIndex(0)].instance || !placed.body.valid()) continue;
    if (!first.valid()) first = link;
    if (world.models[placed.instance].model->links[placed.link].name == "base_link") return link;
  }
  return first;
}

void expect_equal(const Pose& a, const Pose& b, double most, const std::string& what) {
  const Pose off = a.inverse() * b;
  EXPECT_LT(off.translation.norm(), most) << what;
  EXPECT_LT(off.rotation.vec().norm(), most) << what;
}

// Compares all that is known of each step.
class Watch {
 public:
  Watch(const world::WorldModel& world, Kind kind)
      : layout_(world), link_(base_link(world, layout_)), ideal_(kind == Kind::kinematic) {}

  void see(const engine::Channel& channel, std::span<const uint8_t> bytes) {
    if (channel.bus_name.ends_with("/pose") && channel.type == "pose_t") read(bytes, pose_);
    if (channel.bus_name.ends_with("/odometry")) read(bytes, odometry_);
    if (channel.type == "world_state_t") read(bytes, drawn_);
  }

  void see(const Snapshot& now) {
    const world::LinkPlacement& link = layout_.links[link_];
    const Pose& X_WBase = now.robots[RobotIndex(0)].X_WBase;
    const Pose X_WLink = now.bodies[link.body] * link.X_BL;
    if (states_.empty()) {
      start_ = X_WBase;
      apart_ = X_WBase.inverse() * X_WLink;
    }
    const std::string at = " at step " + std::to_string(now.step);
    expect_equal(X_WBase * apart_, X_WLink, 1e-6, "base_link" + at);
    states_[now.time] = X_WBase;
    way_ = (X_WBase.translation - start_.translation).norm();
  }

  // Messages may come after the state that they show.
  void compare() {
    for (const pose_t& pose : pose_) {
      if (pose.utime == 0) continue;  // the handlers come later than that state
      ++compared_;
      expect_equal(states_.at(pose.utime), pose_of(pose.pos, pose.orientation), 1e-9,
                   "ROBOT/pose at " + std::to_string(pose.utime));
    }
    for (const world_state_t& drawn : drawn_) {
      for (int32_t i = 0; i < drawn.n; ++i) {
        if (drawn.index[i] != layout_.links[link_].body) continue;
        ++drawn_compared_;
        expect_equal(states_.at(drawn.utime) * apart_,
                     pose_of(drawn.position[i], drawn.orientation[i]) * layout_.links[link_].X_BL,
                     1e-6, "the console's picture at " + std::to_string(drawn.utime));
      }
    }
    for (const odometry_t& odometry : odometry_) {
      if (!ideal_ || odometry.utime == 0) continue;
      const Pose there = start_.inverse() * states_.at(odometry.utime);
      const std::string at = "odometry at " + std::to_string(odometry.utime);
      EXPECT_NEAR(odometry.x, there.translation.x(), 2e-3) << at;
      EXPECT_NEAR(odometry.y, there.translation.y(), 2e-3) << at;
      EXPECT_NEAR(std::remainder(odometry.theta - heading(there.rotation), 2 * M_PI), 0.0, 2e-3)
          << at;
    }
  }

  double way() const { return way_; }
  int compared() const { return compared_; }
  int drawn() const { return drawn_compared_; }

 private:
  static Pose pose_of(const auto& p, const auto& q) {
    return {Quat(q[0], q[1], q[2], q[3]), Vec3(p[0], p[1], p[2])};
  }

  template <class Message>
  static void read(std::span<const uint8_t> bytes, std::vector<Message>& into) {
    ASSERT_EQ(decode_checked(bytes.data(), bytes.size(), into.emplace_back()), DecodeFault::none);
  }

  world::BodyLayout layout_;
  LinkIndex link_;
  bool ideal_;  // its wheels do not slip
  Pose start_, apart_;
  std::map<SimTime, Pose> states_;
  std::vector<pose_t> pose_;
  std::vector<odometry_t> odometry_;
  std::vector<world_state_t> drawn_;
  double way_ = 0.0;
  int compared_ = 0, drawn_compared_ = 0;
};

// Straight on, then a curve. Returns how far it came, or nothing where it has no such drive.
std::optional<double> drive(const world::WorldModel& loaded, Kind kind) {
  const auto world = with_drive(loaded, kind);
  engine::EngineOptions options;
  options.fleet.noise = false;
  Watch watch(*world, kind);
  std::optional<engine::Engine> engine;
  try {
    engine.emplace(world, options);
  } catch (const InputError&) {
    return {};
  }
  if (engine->driven().size() != 1) return {};
  engine->on_message([&](int, int64_t, const engine::Channel& channel,
                         std::span<const uint8_t> bytes) { watch.see(channel, bytes); });
  engine->on_state([&](int, const Snapshot& now, const engine::Batch&) { watch.see(now); });
  const int64_t turn = 100'000 / engine->step_us();
  for (int i = 0; i < 20; ++i) {
    engine->drive(std::vector<double>{i < 3 ? 0.0 : 0.3, 0.0, i < 12 ? 0.0 : 0.4});
    engine->step(turn);
  }
  watch.compare();
  EXPECT_GT(watch.compared(), 90);
  EXPECT_GT(watch.drawn(), 50);  // 30 a second for 2 s
  return watch.way();
}

std::map<std::string, std::string> robots() {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(RUEDO_SOURCE_DIR "/worlds/robots")) {
    const fs::path file = entry.path() / "model.sdf";
    if (fs::exists(file)) files[entry.path().filename()] = file;
  }
  const std::string public_files = RUEDO_SOURCE_DIR "/../shared/corpus";
  std::ifstream list(RUEDO_SOURCE_DIR "/tests/corpus/robots.txt");
  for (std::string line; std::getline(list, line);) {
    const size_t bar = line.find(" ~ ");
    const std::string file = public_files + "/" + line.substr(bar + 3);
    if (fs::exists(file)) files[line.substr(0, bar)] = file;
  }
  const std::string models = public_files + "/gazebo_models:" + public_files + "/turtlebot3/models";
  setenv("GAZEBO_MODEL_PATH", models.c_str(), 1);
  return files;
}

TEST(OnePose, AllChannelsGiveThePoseOfBaseLink) {
  int kinematic = 0, wheels = 0;
  world::LoadOptions load;
  load.allow_absolute = true;
  for (const auto& [name, file] : robots()) {
    const auto loaded = world::load_world(file, load);
    for (const Kind kind : {Kind::kinematic, Kind::wheels}) {
      SCOPED_TRACE(name + (kind == Kind::wheels ? " on wheels" : ""));
      const std::optional<double> way = drive(*loaded, kind);
      if (!way) continue;
      if (*way > 0.1) ++(kind == Kind::wheels ? wheels : kinematic);
    }
  }
  EXPECT_GE(kinematic, 8);
  EXPECT_GE(wheels, 6);
}

// REP-120: base_footprint is on the ground, and base_link where the file's fixed joint has it. The
// robot's pose is that of base_footprint, if that is below the centre of rotation.
TEST(OnePose, IsTheFootprintsAndKeepsTheJointAboveIt) {
  const std::string inertial =
      "<inertial><mass value='1'/><inertia ixx='0.1' iyy='0.1' izz='0.1' ixy='0' ixz='0' "
      "iyz='0'/></inertial>";
  std::string robot =
      "<robot name='bot'><link name='base_footprint'/><link name='base_link'>" + inertial +
      "<collision><origin xyz='0.2 0 -0.06'/><geometry><sphere radius='0.04'/></geometry>"
      "</collision></link><joint name='base_joint' type='fixed'><parent link='base_footprint'/>"
      "<child link='base_link'/><origin xyz='0.03 0 0.1' rpy='0 0 0.25'/></joint>";
  for (const std::string side : {"left", "right"}) {
    const std::string y = side == "left" ? "0.2" : "-0.2", wheel = side + "_wheel";
    robot += "<link name='" + wheel + "'>" + inertial +
             "<collision><geometry><sphere radius='0.1'/></geometry></collision></link><joint "
             "name='" +
             wheel + "' type='continuous'><parent link='base_footprint'/><child link='" + wheel +
             "'/><origin xyz='0 " + y + " 0.1'/><axis xyz='0 1 0'/></joint>";
  }
  robot +=
      "<gazebo><plugin name='d' filename='libgazebo_ros_diff_drive.so'>"
      "<left_joint>left_wheel</left_joint><right_joint>right_wheel</right_joint></plugin></gazebo>"
      "</robot>";
  const auto world = world::load_world_text(robot, "bot.urdf");
  const world::BodyLayout layout(*world);
  const world::LinkPlacement& link = layout.links[base_link(*world, layout)];
  const Pose X_FootprintLink{Quat(Eigen::AngleAxisd(0.25, Vec3::UnitZ())), Vec3(0.03, 0, 0.1)};
  engine::Engine engine(world, {});
  int states = 0;
  engine.on_state([&](int, const Snapshot& now, const engine::Batch&) {
    ++states;
    expect_equal(now.robots[RobotIndex(0)].X_WBase * X_FootprintLink,
                 now.bodies[link.body] * link.X_BL, 1e-6, "at step " + std::to_string(now.step));
  });
  engine.drive(std::vector<double>{0.3, 0.0, 0.4});
  engine.step(200);
  EXPECT_GE(states, 200);
}

}  // namespace
}  // namespace ruedo
