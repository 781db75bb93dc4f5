// How the cost of a step of the physics grows with what the world has, at 5 ms, without sensors.
//
// Args: the number of bodies or joints. "Resting": boxes asleep on a plane, and one ball that
// rolls. "Sliding": boxes that slide on it, each by itself. "Free", "AtStops": a chain of hinges
// fixed at one end, its limits out of reach, and reached by each joint. "Fingers": on one base. The
// counter each_us is per body or joint.
#include <string>

#include <benchmark/benchmark.h>

#include "physics/physics_world.h"
#include "world/load.h"

namespace {

using namespace ruedo;

const std::string kPlane =
    "<model name='ground'><static>true</static><link name='l'><collision name='c'><geometry><plane>"
    "<normal>0 0 1</normal></plane></geometry></collision></link></model>";

std::string inertial(double mass, const std::string& pose = "0 0 0 0 0 0") {
  const std::string moment = std::to_string(0.01 * mass);
  return "<inertial><pose>" + pose + "</pose><mass>" + std::to_string(mass) +
         "</mass><inertia><ixx>" + moment + "</ixx><iyy>" + moment + "</iyy><izz>" + moment +
         "</izz></inertia></inertial>";
}

std::string body(const std::string& name, double x, double y, const std::string& geometry,
                 double friction) {
  const std::string mu = std::to_string(friction);
  return "<model name='" + name + "'><pose>" + std::to_string(x) + " " + std::to_string(y) +
         " 0.1 0 0 0</pose><link name='l'>" + inertial(1.0) + "<collision name='c'><geometry>" +
         geometry + "</geometry><surface><friction><ode><mu>" + mu + "</mu><mu2>" + mu +
         "</mu2></ode></friction></surface></collision></link></model>";
}

std::string boxes(int n, double friction) {
  std::string models = kPlane;
  for (int i = 0; i < n; ++i)
    models += body("b" + std::to_string(i), 0.6 * (i % 100), 0.6 * (i / 100),
                   "<box><size>0.2 0.2 0.2</size></box>", friction);
  return models;
}

std::string hinge(const std::string& name, const std::string& parent, const std::string& child,
                  double limit) {
  const std::string most = std::to_string(limit);
  return "<joint name='" + name + "' type='revolute'><parent>" + parent + "</parent><child>" +
         child + "</child><axis><xyz>0 1 0</xyz><limit><lower>-" + most + "</lower><upper>" + most +
         "</upper></limit></axis></joint>";
}

std::string link(const std::string& name, double x, double y) {
  return "<link name='" + name + "'><pose>" + std::to_string(x) + " " + std::to_string(y) +
         " 1 0 0 0</pose>" + inertial(0.1, "0.05 0 0 0 0 0") + "</link>";
}

std::string chain(int n, double limit) {
  std::string model = "<model name='m'>", before = "world";
  for (int i = 0; i < n; ++i) {
    const std::string name = "l" + std::to_string(i);
    model += link(name, 0.1 * i, 0.0) + hinge("j" + std::to_string(i), before, name, limit);
    before = name;
  }
  return model + "</model>";
}

std::string fingers(int n) {
  std::string model = "<model name='m'>" + link("base", 0.0, 0.0) +
                      "<joint name='hold' type='fixed'><parent>world</parent><child>base</child>"
                      "</joint>";
  for (int i = 0; i < n; ++i) {
    const std::string name = "l" + std::to_string(i);
    model += link(name, 0.0, 0.1 * i) + hinge("j" + std::to_string(i), "base", name, 3.0);
  }
  return model + "</model>";
}

struct World {
  World(const std::string& models, double settle_s)
      : world(world::load_world_text(
            "<sdf version='1.9'><world name='w'><physics type='x'><max_step_size>0.005"
            "</max_step_size></physics>" +
                models + "</world></sdf>",
            "growth.sdf")),
        layout(*world),
        physics(*world, layout) {
    for (int i = 0; i < static_cast<int>(settle_s / 0.005); ++i) physics.step();
  }
  std::shared_ptr<const world::WorldModel> world;
  world::BodyLayout layout;
  physics::PhysicsWorld physics;
};

void measure(benchmark::State& state, World& world) {
  Snapshot snapshot;
  for (auto _ : state) {
    world.physics.step();
    world.physics.read(snapshot);
  }
  state.counters["each_us"] =
      benchmark::Counter(1e-6 * static_cast<double>(state.iterations() * state.range(0)),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void Resting(benchmark::State& state) {
  World world(boxes(static_cast<int>(state.range(0)), 0.5) +
                  body("ball", -100.0, 0.0, "<sphere><radius>0.1</radius></sphere>", 0.5),
              3.0);
  const BodyIndex ball(world.layout.bodies.size() - 1);
  world.physics.set_twist(ball, {{0.1, 0, 0}, {0, 1, 0}});
  world.physics.wake(ball);
  measure(state, world);
}

void Sliding(benchmark::State& state) {
  World world(boxes(static_cast<int>(state.range(0)), 0.0), 0.0);
  for (const BodyIndex i : world.layout.bodies.indices())
    world.physics.set_twist(i, {{1, 0, 0}, {0, 0, 0}});
  measure(state, world);
}

void Free(benchmark::State& state) {
  World world(chain(static_cast<int>(state.range(0)), 3.0), 0.1);
  measure(state, world);
}

void AtStops(benchmark::State& state) {
  World world(chain(static_cast<int>(state.range(0)), 0.002), 0.5);
  measure(state, world);
}

void Fingers(benchmark::State& state) {
  World world(fingers(static_cast<int>(state.range(0))), 0.1);
  measure(state, world);
}

BENCHMARK(Resting)->Arg(10)->Arg(100)->Arg(1000)->Arg(5000)->Unit(benchmark::kMicrosecond);
BENCHMARK(Sliding)->Arg(10)->Arg(100)->Arg(1000)->Arg(5000)->Unit(benchmark::kMicrosecond);
BENCHMARK(Free)->Arg(10)->Arg(75)->Arg(150)->Arg(300)->Unit(benchmark::kMicrosecond);
BENCHMARK(AtStops)->Arg(10)->Arg(75)->Arg(150)->Arg(300)->Unit(benchmark::kMicrosecond);
BENCHMARK(Fingers)->Arg(10)->Arg(75)->Arg(150)->Arg(300)->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
