// The fast caster against the slow one, ray by ray and bit by bit, in random worlds; and a scene's
// guarantees: movers, ignored links, ties, limits, bad rays, threads.
#include <cstring>
#include <thread>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "ray_worlds.h"

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace ruedo::scene {
namespace {

using world::Shape;

bool same_bits(const Hit& a, const Hit& b) {
  return std::memcmp(&a.range, &b.range, sizeof a.range) == 0 && a.link == b.link &&
         a.shape == b.shape &&
         std::memcmp(a.normal.data(), b.normal.data(), 3 * sizeof(double)) == 0;
}

world::Geometry random_geometry(RandomStream& random) {
  const Vec3 size(0.2 + 2 * random.uniform(), 0.2 + 2 * random.uniform(),
                  0.2 + 2 * random.uniform());
  switch (random.bits() % 9) {
    case 0: return geometry(Shape::sphere, size);
    case 1: return geometry(Shape::cylinder, size);
    case 2: return geometry(Shape::capsule, size);
    case 3: return geometry(Shape::ellipsoid, size);
    case 4: return geometry(Shape::cone, size);
    case 5: return mesh_geometry(ball_mesh(12, 1.0f), size);
    case 6: return mesh_geometry(random.bits() % 2 ? cube_mesh() : opened(*cube_mesh()), size);
    default: return geometry(Shape::box, size);
  }
}

struct Scenes {
  World world;
  std::unique_ptr<world::BodyLayout> layout;
  std::unique_ptr<RayScene> fast, slow;
  Snapshot snapshot;

  void make(bool visuals = false) {
    layout = std::make_unique<world::BodyLayout>(world.model);
    fast = make_ray_scene(make_static_ray_scene(world.model, *layout, visuals, Backend::embree));
    slow = make_ray_scene(make_static_ray_scene(world.model, *layout, visuals, Backend::reference));
    for (const auto& body : layout->bodies) snapshot.bodies.push_back(body.X_WB);
    snapshot.wheel_angles.resize(layout->wheels.size());
  }
  void update() {
    fast->update(snapshot);
    slow->update(snapshot);
  }
};

// Rays from a few places, as sensors cast them, and from everywhere.
std::vector<Ray> random_rays(RandomStream& random, int count, double size) {
  std::vector<Ray> rays;
  Vec3 origin = random_vector(random, size);
  for (int i = 0; i < count; ++i) {
    if (i % 20 == 0 || i > count / 2) origin = random_vector(random, i % 7 ? size : 20 * size);
    const Vec3 direction = i % 5 ? random_direction(random) : Vec3::Unit(i % 3);
    rays.push_back({origin, direction,
                    i % 3 ? std::numeric_limits<double>::infinity() : 3 * size * random.uniform()});
  }
  return rays;
}

TEST(RayScene, RandomWorldsEqualTheReference) {
  int hits = 0, inside = 0;
  for (int seed = 0; seed < 30; ++seed) {
    RandomStream random = RandomSource(7, "rays", "worlds").stream(static_cast<uint64_t>(seed));
    const double size = seed % 3 == 2 ? 200.0 : 8.0;
    Scenes scenes;
    if (seed % 2) scenes.world.add(at({0, 0, -size / 2}), plane({0, 0, 1}));
    for (int i = 0; i < 25; ++i) {
      std::vector<std::pair<Pose, world::Geometry>> shapes;
      for (uint32_t k = random.bits() % 4; k < 4; ++k)
        shapes.emplace_back(random_pose(random, 1.5), random_geometry(random));
      scenes.world.add(random_pose(random, size), std::move(shapes), i % 2 == 0);
    }
    scenes.make();
    const std::vector<Ray> rays = random_rays(random, 600, size);
    std::vector<Hit> fast(rays.size()), slow(rays.size());
    for (int round = 0; round < 3; ++round) {
      const LinkIndex ignored =
          round == 0 ? LinkIndex() : LinkIndex(random.bits() % scenes.layout->links.size());
      scenes.fast->cast(rays, fast, ignored);
      scenes.slow->cast(rays, slow, ignored);
      for (size_t i = 0; i < rays.size(); ++i) {
        ASSERT_TRUE(same_bits(fast[i], slow[i]))
            << "world " << seed << " round " << round << " ray " << i << ": " << fast[i].range
            << " and " << slow[i].range;
        ASSERT_TRUE(same_bits(fast[i], scenes.fast->cast(rays[i], ignored))) << "single ray " << i;
        hits += fast[i].hit();
        inside += fast[i].range == 0.0;
      }
      for (Pose& pose : scenes.snapshot.bodies) pose = random_pose(random, size);
      scenes.update();
    }
  }
  EXPECT_GT(hits, 5000);
  EXPECT_GT(inside, 200);
}

// Many small steps: after refitting the results must equal those of a new scene.
TEST(RayScene, MoversStayRightAfterManySteps) {
  RandomStream random = RandomSource(8, "rays", "movers").stream(0);
  Scenes scenes;
  for (int i = 0; i < 60; ++i)
    scenes.world.add(random_pose(random, 5.0), random_geometry(random), false);
  scenes.make();
  const std::vector<Ray> rays = random_rays(random, 100, 6.0);
  std::vector<Hit> fast(rays.size()), slow(rays.size());
  for (int step = 0; step < 300; ++step) {
    for (Pose& pose : scenes.snapshot.bodies) pose = (pose * random_pose(random, 0.3)).normalized();
    scenes.update();
    scenes.fast->cast(rays, fast);
    scenes.slow->cast(rays, slow);
    for (size_t i = 0; i < rays.size(); ++i)
      ASSERT_TRUE(same_bits(fast[i], slow[i])) << step << " " << i;
  }
}

TEST(RayScene, TiesGoToTheLowestLinkAndShape) {
  for (const bool is_static : {true, false}) {
    Scenes scenes;
    const Pose there = at({5, 0, 0});
    scenes.world.add(at({7, 0, 0}), geometry(Shape::box, {2, 2, 2}), true);
    scenes.world.add(there,
                     {{Pose(), geometry(Shape::box, {1, 1, 1})},
                      {Pose(), geometry(Shape::box, {2, 2, 2})},
                      {Pose(), geometry(Shape::box, {2, 2, 2})}},
                     is_static);
    scenes.world.add(there, geometry(Shape::box, {2, 2, 2}), !is_static);
    scenes.make();
    for (const RayScene* scene : {scenes.fast.get(), scenes.slow.get()}) {
      Hit hit = scene->cast({Vec3::Zero(), Vec3::UnitX()});
      EXPECT_EQ(hit.range, 4.0);
      EXPECT_EQ(hit.link, 1);
      EXPECT_EQ(hit.shape, 1);
      hit = scene->cast({Vec3::Zero(), Vec3::UnitX()}, LinkIndex(1));
      EXPECT_EQ(hit.range, 4.0);
      EXPECT_EQ(hit.link, 2);
      EXPECT_EQ(scene->cast({{5, 0, 0}, Vec3::UnitX()}).link, 1);  // inside of all
      EXPECT_EQ(scene->cast({{5, 0, 0}, Vec3::UnitX()}).shape, 0);
    }
  }
}

TEST(RayScene, MaximumRangeIsInclusive) {
  Scenes scenes;
  scenes.world.add(at({5, 0, 0}), geometry(Shape::box, {2, 2, 2}));
  scenes.make();
  EXPECT_EQ(scenes.fast->cast({Vec3::Zero(), Vec3::UnitX(), 4.0}).range, 4.0);
  EXPECT_FALSE(scenes.fast->cast({Vec3::Zero(), Vec3::UnitX(), std::nextafter(4.0, 0.0)}).hit());
  EXPECT_FALSE(scenes.fast->cast({Vec3::Zero(), Vec3::UnitX(), 0.0}).hit());
  EXPECT_EQ(scenes.fast->cast({{5, 0, 0}, Vec3::UnitX(), 0.0}).range, 0.0);
}

TEST(RayScene, BadRaysHitNothing) {
  Scenes scenes;
  scenes.world.add({}, geometry(Shape::box, {2, 2, 2}));
  scenes.world.add(at({0, 0, -1}), plane({0, 0, 1}));
  scenes.world.add(at({5, 0, 0}), geometry(Shape::sphere, {1, 0, 0}), false);
  scenes.make();
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  std::vector<Ray> rays;
  for (const double bad : {nan, inf, -inf})
    for (int axis = 0; axis < 3; ++axis) {
      Ray ray{{-5, 0, 0}, {1, 0, 0}};
      ray.origin[axis] = bad;
      rays.push_back(ray);
      ray = {{-5, 0, 0}, {1, 0, 0}};
      ray.direction[axis] = bad;
      rays.push_back(ray);
    }
  rays.push_back({{-5, 0, 0}, {1, 0, 0}, nan});
  rays.push_back({{-5, 0, 0}, {1, 0, 0}, -1.0});
  rays.push_back({{-5, 0, 0}, {0, 0, 0}});
  rays.push_back({{-5, 0, 0}, {1e200, 0, 0}});
  rays.push_back({{-1e200, 0, 0}, {1, 0, 0}});
  rays.push_back({{-5, 0, 0}, {1, 0, 0}});  // a good one among them
  std::vector<Hit> hits(rays.size());
  scenes.fast->cast(rays, hits);
  for (size_t i = 0; i + 1 < rays.size(); ++i) EXPECT_FALSE(hits[i].hit()) << i;
  EXPECT_EQ(hits.back().range, 4.0);
  EXPECT_FALSE(scenes.fast->cast({{1e300, 0, 0}, {1, 0, 0}}).hit());
  EXPECT_TRUE(scenes.fast->cast({{-1e9, 0, 0}, {1, 0, 0}}).hit());
}

TEST(RayScene, MoversWithANanPoseAreNotHit) {
  Scenes scenes;
  scenes.world.add(at({5, 0, 0}), geometry(Shape::sphere, {1, 0, 0}), false);
  scenes.world.add(at({9, 0, 0}), geometry(Shape::sphere, {1, 0, 0}), false);
  scenes.make();
  EXPECT_EQ(scenes.fast->cast({Vec3::Zero(), Vec3::UnitX()}).range, 4.0);
  scenes.snapshot.bodies[0].translation.x() = std::nan("");
  scenes.fast->update(scenes.snapshot);
  EXPECT_EQ(scenes.fast->cast({Vec3::Zero(), Vec3::UnitX()}).range, 8.0);
  scenes.snapshot.bodies[0].translation.x() = 3;
  scenes.fast->update(scenes.snapshot);
  EXPECT_EQ(scenes.fast->cast({Vec3::Zero(), Vec3::UnitX()}).range, 2.0);
}

// A wheel with a box on it: a bar of 1 m along z, turning about y. At 90 degrees it points along x.
TEST(RayScene, WheelsTurn) {
  Scenes scenes;
  scenes.world.add({}, geometry(Shape::box, {0.1, 0.1, 1.0}), false);
  scenes.layout = std::make_unique<world::BodyLayout>(scenes.world.model);
  scenes.layout->links[0].wheel = WheelIndex(0);
  world::WheelPlacement wheel;
  wheel.link = LinkIndex(0);
  wheel.axis_in_L = Vec3::UnitY();
  scenes.layout->wheels.push_back(wheel);
  for (const Backend backend : {Backend::embree, Backend::reference}) {
    const auto scene =
        make_ray_scene(make_static_ray_scene(scenes.world.model, *scenes.layout, false, backend));
    Snapshot snapshot;
    snapshot.bodies.resize(1);
    snapshot.wheel_angles = {0.0};
    scene->update(snapshot);
    EXPECT_NEAR(scene->cast({{-2, 0, 0}, Vec3::UnitX()}).range, 1.95, 1e-12);
    snapshot.wheel_angles = {M_PI / 2};
    scene->update(snapshot);
    const Hit hit = scene->cast({{-2, 0, 0}, Vec3::UnitX()});
    EXPECT_NEAR(hit.range, 1.5, 1e-12);
    EXPECT_NEAR((hit.normal + Vec3::UnitX()).norm(), 0.0, 1e-12);
  }
}

// A bar that turns about its middle, 1 m ahead of its link's origin, and a cube fixed to it, whose
// link is turned left by a right angle. The wheel's quarter turn about y takes what is above the
// axis ahead of it.
TEST(RayScene, WheelsTurnAboutTheirAxisWhereverTheirLinksAre) {
  World world;
  world.add({}, {{at({1, 0, 0}), geometry(Shape::box, {0.1, 0.1, 1.0})}}, false);
  auto model = std::make_shared<world::Model>(*world.model.models[0].model);
  world::Link cap;
  cap.name = "cap";
  cap.X_ML = {Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ())), Vec3(1, 0, 0)};
  cap.collisions.emplace_back();
  cap.collisions[0].X_LC = at({2, 0, 0.5});  // in the model: (1, 2, 0.5)
  cap.collisions[0].geometry = geometry(Shape::box, {0.2, 0.2, 0.2});
  model->links.push_back(cap);
  world::Joint joint;
  joint.type = world::JointType::fixed;
  joint.parent = ModelLinkIndex(0);
  joint.child = ModelLinkIndex(1);
  model->joints.push_back(joint);
  world.model.models[0].model = model;
  world::BodyLayout layout(world.model);
  ASSERT_EQ(layout.bodies.size(), 1u);
  layout.links[0].wheel = layout.links[1].wheel = WheelIndex(0);
  world::WheelPlacement wheel;
  wheel.link = LinkIndex(0);
  wheel.center_in_L = Vec3(1, 0, 0);
  layout.wheels.push_back(wheel);
  for (const Backend backend : {Backend::embree, Backend::reference}) {
    const auto scene = make_ray_scene(make_static_ray_scene(world.model, layout, false, backend));
    Snapshot snapshot;
    snapshot.bodies.resize(1);
    snapshot.wheel_angles = {0.0};
    scene->update(snapshot);
    EXPECT_NEAR(scene->cast({{-2, 0, 0}, Vec3::UnitX()}).range, 2.95, 1e-12);
    EXPECT_NEAR(scene->cast({{-2, 2, 0.5}, Vec3::UnitX()}).range, 2.9, 1e-12);
    snapshot.wheel_angles = {M_PI / 2};
    scene->update(snapshot);
    EXPECT_NEAR(scene->cast({{-2, 0, 0}, Vec3::UnitX()}).range, 2.5, 1e-12);
    EXPECT_NEAR(scene->cast({{-2, 2, 0}, Vec3::UnitX()}).range, 3.4, 1e-12);
  }
}

TEST(RayScene, VisualsWhenAsked) {
  World world;
  world.add({}, geometry(Shape::box, {2, 2, 2}));
  auto model = std::make_shared<world::Model>(*world.model.models[0].model);
  world::Visual visual;
  visual.geometry = geometry(Shape::sphere, {0.5, 0, 0});
  model->links[0].visuals.push_back(visual);
  visual.X_LV.translation.x() = -1.0;
  visual.transparency = 1.0;  // nothing to be seen
  model->links[0].visuals.push_back(visual);
  visual.transparency = 0.0;
  visual.X_LV.translation.x() = 3.0;
  visual.geometry = plane(-Vec3::UnitX());
  visual.geometry.extent = {1.0, 2.0};  // a wall of 1 m (along z: x of the plane) by 2 m
  model->links[0].visuals.push_back(visual);
  world.model.models[0].model = model;
  const world::BodyLayout layout(world.model);
  const auto scene = make_ray_scene(make_static_ray_scene(world.model, layout, true));
  EXPECT_EQ(scene->cast({{-5, 0, 0}, Vec3::UnitX()}).range, 4.5);
  EXPECT_NEAR(scene->cast({{-5, 0.9, 0.4}, Vec3::UnitX()}).range, 8.0, 1e-12);
  EXPECT_EQ(scene->cast({{-5, 0.9, 0.4}, Vec3::UnitX()}).shape, 2);
  EXPECT_FALSE(scene->cast({{-5, 0.9, 0.6}, Vec3::UnitX()}).hit());
  EXPECT_FALSE(scene->cast({{-5, 1.1, 0.4}, Vec3::UnitX()}).hit());
}

TEST(RayScene, EmptyWorld) {
  Scenes scenes;
  scenes.make();
  scenes.update();
  EXPECT_FALSE(scenes.fast->cast({Vec3::Zero(), Vec3::UnitX()}).hit());
}

TEST(RayScene, ThreadsCastTheSame) {
  RandomStream random = RandomSource(9, "rays", "threads").stream(0);
  Scenes scenes;
  for (int i = 0; i < 40; ++i)
    scenes.world.add(random_pose(random, 5.0), random_geometry(random), i % 2 == 0);
  scenes.make();
  const std::vector<Ray> rays = random_rays(random, 4000, 6.0);
  std::vector<std::vector<Hit>> hits(4, std::vector<Hit>(rays.size()));
  std::vector<std::thread> threads;
  for (auto& mine : hits) threads.emplace_back([&] { scenes.fast->cast(rays, mine); });
  for (std::thread& thread : threads) thread.join();
  for (size_t k = 1; k < hits.size(); ++k)
    for (size_t i = 0; i < rays.size(); ++i) ASSERT_TRUE(same_bits(hits[0][i], hits[k][i])) << i;
}

// Embree takes its threads from TBB, as the modules do for their pieces: it must not withhold them
// from the modules.
TEST(RayScene, LeavesTbbItsThreads) {
  constexpr auto kThreads = tbb::global_control::max_allowed_parallelism;
  const tbb::global_control four(kThreads, 4);  // on one core, too
  Scenes scenes;
  scenes.world.add(at({1, 0, 0}), geometry(world::Shape::box, {1, 1, 1}));
  scenes.make();
  EXPECT_EQ(tbb::global_control::active_value(kThreads), 4u);
}

#if defined(__SSE2__)
TEST(RayScene, FloatModeStays) {
  const unsigned before = _mm_getcsr() & ~0x3fu;  // but for the sticky exception flags
  Scenes scenes;
  for (int i = 0; i < 100; ++i)
    scenes.world.add(at({double(i), 0, 0}), mesh_geometry(ball_mesh(12, 0.3f)), i % 2 == 0);
  scenes.make();
  scenes.update();
  scenes.fast->cast({Vec3::Zero(), Vec3::UnitX()});
  EXPECT_EQ(_mm_getcsr() & ~0x3fu, before);
}
#endif

}  // namespace
}  // namespace ruedo::scene
