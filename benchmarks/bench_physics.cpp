// Cost of a step of physics and robots: kinematic robots circling on a plane among 300 static
// boxes, at 5 ms.
//
// Args: the number of robots. "Rooms": each in a square of its own, never near anything. "Resting":
// asleep. "Crowd": close together, so that they touch. The snapshot is read in each step, as the
// server does.
#include <cmath>
#include <memory>

#include <benchmark/benchmark.h>

#include "physics/physics_world.h"
#include "robot/robots.h"

namespace {

using namespace ruedo;

world::Geometry shape(world::Shape kind, const Vec3& size) {
  world::Geometry geometry;
  geometry.shape = kind;
  geometry.size = size;
  return geometry;
}

std::shared_ptr<world::Model> robot_model() {
  auto robot = std::make_shared<world::Model>();
  robot->name = "robot";
  world::Link base;
  base.name = "base";
  base.inertial = {14.0, Pose{Quat::Identity(), {0, 0, 0.15}}, Vec3(0.3, 0.4, 0.5).asDiagonal()};
  base.collisions.push_back({"c",
                             Pose{Quat::Identity(), {0, 0, 0.18}},
                             shape(world::Shape::box, {0.5, 0.3, 0.15}),
                             {},
                             {}});
  robot->links.push_back(base);
  world::DriveDescription drive;
  drive.wheel_radius = 0.111;
  drive.track = 0.394;
  drive.watchdog_us = 0;
  drive.acceleration = drive.deceleration = 0.5;
  drive.turn_acceleration = 1.0;
  for (const double y : {0.197, -0.197}) {
    for (const double x : {0.135, -0.134}) {
      world::Link wheel;
      wheel.name = "wheel" + std::to_string(robot->links.size());
      wheel.X_ML = {Quat(Eigen::AngleAxisd(-M_PI / 2, Vec3::UnitX())), {x, y, 0.111}};
      wheel.inertial = {1.5, Pose(), Vec3(0.005, 0.005, 0.009).asDiagonal()};
      wheel.collisions.push_back(
          {"c", {}, shape(world::Shape::cylinder, {0.111, 0.075, 0}), {}, {}});
      world::Joint joint;
      joint.name = wheel.name + "_joint";
      joint.type = world::JointType::continuous;
      joint.parent = ModelLinkIndex(0);
      joint.child = robot->links.next();
      joint.X_MJ = wheel.X_ML;
      (y > 0 ? drive.left_joints : drive.right_joints).push_back(robot->joints.next());
      robot->links.push_back(wheel);
      robot->joints.push_back(joint);
    }
  }
  robot->drive = drive;
  return robot;
}

world::ModelInstance fixed(const std::string& name, const Pose& pose,
                           const world::Geometry& geometry) {
  auto thing = std::make_shared<world::Model>();
  thing->is_static = true;
  world::Link link;
  link.name = "link";
  link.collisions.push_back({"c", {}, geometry, {}, {}});
  thing->links.push_back(link);
  return {name, pose, thing};
}

world::WorldModel world_of(int robots, double spacing_m) {
  world::WorldModel world;
  world.models.push_back(fixed("ground", {}, shape(world::Shape::plane, {1, 1, 1})));
  const int side = static_cast<int>(std::ceil(std::sqrt(robots)));
  for (int i = 0; i < 300; ++i) {
    const double x = (i % 20 - 0.5) * spacing_m, y = (i / 20 - 0.5) * spacing_m;
    world.models.push_back(fixed("box" + std::to_string(i), {Quat::Identity(), {x, y, 0.25}},
                                 shape(world::Shape::box, {0.3, 0.3, 0.5})));
  }
  const auto robot = robot_model();
  for (int i = 0; i < robots; ++i) {
    world.models.push_back(
        {"robot" + std::to_string(i),
         Pose{Quat::Identity(), {i % side * spacing_m, i / side * spacing_m, 0.0}}, robot});
  }
  return world;
}

void run(benchmark::State& state, double spacing_m, double v, double omega) {
  const int n = static_cast<int>(state.range(0));
  const world::WorldModel world = world_of(n, spacing_m);
  const world::BodyLayout layout(world);
  physics::PhysicsWorld physics(world, layout);
  robot::Robots robots(world, layout, physics);
  Snapshot snapshot;
  for (int i = 0; i < n && (v != 0.0 || omega != 0.0); ++i)
    robots.apply({RobotIndex(i), robot::VelocityCommand{v, 0.0, omega}});
  for (int i = 0; i < 400; ++i) robots.step();  // up to speed
  for (auto _ : state) {
    robots.step();
    robots.read(snapshot);
  }
}

void Rooms(benchmark::State& state) { run(state, 6.0, 0.4, 0.4); }
void Crowd(benchmark::State& state) { run(state, 0.9, 0.4, 0.4); }
void Resting(benchmark::State& state) { run(state, 6.0, 0.0, 0.0); }

BENCHMARK(Rooms)->Arg(1)->Arg(10)->Arg(100)->Arg(1000)->Arg(10000)->Unit(benchmark::kMicrosecond);
BENCHMARK(Crowd)->Arg(100)->Arg(1000)->Unit(benchmark::kMicrosecond);
BENCHMARK(Resting)->Arg(1000)->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
