// A world from SDF text with its physics, and things to put into it, for tests of the physics.
#pragma once

#include <cmath>
#include <ctime>
#include <memory>
#include <string>

#include "physics/physics_world.h"
#include "world/load.h"

namespace ruedo::physics::testing {

// CPU time of the caller's thread for doing that so many times.
template <class Do>
double seconds_of(Do&& act, int times) {
  const auto now = [] {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  const double begin = now();
  for (int i = 0; i < times; ++i) act();
  return now() - begin;
}

class World {
 public:
  // solver: the content of <bullet>.
  explicit World(const std::string& models, int64_t step_us = 2000, const std::string& solver = "")
      : world(world::load_world_text("<sdf version='1.9' xmlns:ruedo='https://ruedo.org'><world "
                                     "name='w'><gravity>0 0 -10</gravity>"
                                     "<physics type='x'><max_step_size>" +
                                         std::to_string(static_cast<double>(step_us) * 1e-6) +
                                         "</max_step_size><bullet>" + solver +
                                         "</bullet></physics>" + models + "</world></sdf>",
                                     "test.sdf", anywhere())),
        layout(*world),
        physics(*world, layout) {}
  void run(double seconds) {
    const auto steps = static_cast<int64_t>(std::llround(seconds * 1e6)) / world->step_us;
    for (int64_t i = 0; i < steps; ++i) physics.step();
  }
  // CPU time of that many steps.
  double seconds_of(int steps) {
    return testing::seconds_of([this] { physics.step(); }, steps);
  }
  BodyIndex body(const std::string& name) const {
    for (const BodyIndex i : layout.bodies.indices()) {
      if (layout.bodies[i].name == name) return i;
    }
    return {};
  }
  Vec3 position(const std::string& name) const { return physics.pose(body(name)).translation; }
  std::shared_ptr<const world::WorldModel> world;
  world::BodyLayout layout;
  PhysicsWorld physics;

 private:
  static world::LoadOptions anywhere() {
    world::LoadOptions options;
    options.allow_absolute = true;  // meshes that a test wrote
    return options;
  }
};

inline const std::string kPlane =
    "<model name='ground'><static>true</static><link name='l'><collision "
    "name='c'><geometry><plane><normal>0 0 1"
    "</normal></plane></geometry></collision></link></model>";

inline std::string thing(const std::string& name, const std::string& pose,
                         const std::string& geometry, double mass, double mu = 0.5,
                         double inertia = 0.01) {
  const std::string i = std::to_string(inertia);
  return "<model name='" + name + "'><pose>" + pose + "</pose>" +
         (mass > 0 ? "" : "<static>true</static>") + "<link name='l'>" +
         (mass > 0 ? "<inertial><mass>" + std::to_string(mass) + "</mass><inertia><ixx>" + i +
                         "</ixx><iyy>" + i + "</iyy><izz>" + i + "</izz></inertia></inertial>"
                   : "") +
         "<collision name='c'><geometry>" + geometry + "</geometry><surface><friction><ode><mu>" +
         std::to_string(mu) + "</mu><mu2>" + std::to_string(mu) +
         "</mu2></ode></friction></surface></collision></link></model>";
}

inline const std::string kBall = "<sphere><radius>0.1</radius></sphere>";
inline const std::string kBox = "<box><size>0.2 0.2 0.2</size></box>";

}  // namespace ruedo::physics::testing
