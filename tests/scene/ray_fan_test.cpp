// Fans: what they select for rays from one origin, against every ray's own test; and the caster's
// results for them, against the slow one.
#include <set>

#include <gtest/gtest.h>

#include "ray_worlds.h"
#include "scene/rays/ray_fan.h"

namespace ruedo::scene {
namespace {

using world::Shape;

// Directions of a range finder that turns about a tilted axis, or of a cone.
std::vector<Vec3> random_fan(RandomStream& random, size_t count, double widest) {
  const Quat mount = random.bits() % 2 ? random_pose(random, 1.0).rotation : Quat::Identity();
  const double width = widest * random.uniform(), first = 2 * M_PI * random.uniform();
  const double spread = random.bits() % 3 ? 0.0 : random.uniform();
  std::vector<Vec3> directions;
  for (size_t i = 0; i < count; ++i) {
    const double angle = first + width * static_cast<double>(i) / static_cast<double>(count);
    const Vec3 level(std::cos(angle), std::sin(angle), spread * (random.uniform() - 0.5));
    directions.push_back(i % 50 == 49 ? Vec3::Unit(i % 3) : Vec3((mount * level).normalized()));
  }
  return directions;
}

Box random_box(RandomStream& random, double size) {
  Box box;
  const Vec3 center = random_vector(random, size);
  box.add(center);
  box.add(center + random_vector(random, 1.5));
  return box;
}

TEST(RayFan, VisitsAllThatItsRaysMeetAndFewOthers) {
  int met = 0, visited = 0, tested = 0;
  for (uint64_t seed = 0; seed < 1000; ++seed) {
    RandomStream random = RandomSource(9, "rays", "fans").stream(seed);
    std::vector<Box> boxes;
    for (int i = 0; i < 100; ++i) boxes.push_back(random_box(random, 6.0));
    BoxTree tree;
    tree.build(boxes);
    const Vec3 origin = random_vector(random, 6.0);
    const double range = 1.0 + 5.0 * random.uniform();
    const std::vector<Vec3> directions = random_fan(random, 8, seed % 4 == 0 ? 2 * M_PI : 0.3);
    RayBatch batch;
    Box reach;
    reach.add(origin);
    for (size_t lane = 0; lane < 8; ++lane) {
      batch.world.o[lane] = origin;
      batch.world.d[lane] = directions[lane];
      batch.t[lane] = range;
      reach.add(origin + range * directions[lane]);
    }
    RayFan fan;
    if (!fan.collect(tree, origin, reach)) continue;
    std::set<size_t> found;
    double last = 0.0;
    fan.visit(0xff, batch, [&](size_t i) {
      found.insert(i);
      const Box& box = boxes[i];
      const double distance =
          (box.lower - origin).cwiseMax(origin - box.upper).cwiseMax(0.0).norm();
      EXPECT_GE(distance, 0.998 * last);
      last = std::max(last, distance);
    });
    for (size_t i = 0; i < boxes.size(); ++i) {
      bool meets = false;
      for (const Vec3& d : directions) meets = meets || boxes[i].entry(origin, d) <= range;
      EXPECT_LE(meets, found.count(i) == 1) << seed << " box " << i;
      met += meets;
    }
    visited += static_cast<int>(found.size());
    tested += static_cast<int>(boxes.size());
  }
  EXPECT_GT(met, 300);
  EXPECT_LT(visited, 5 * met);
  EXPECT_LT(visited, tested / 20);
}

TEST(RayFan, RefusesMoreBoxesThanItHolds) {
  BoxTree tree;
  tree.build(std::vector<Box>(100, Box{Vec3(1, 1, 1), Vec3(2, 2, 2)}));
  RayFan fan;
  EXPECT_FALSE(fan.collect(tree, Vec3::Zero(), Box{Vec3::Zero(), Vec3(3, 3, 3)}));
  EXPECT_TRUE(fan.collect(tree, Vec3::Zero(), Box{Vec3::Zero(), Vec3(0.5, 0.5, 0.5)}));
}

// Walls, posts and balls, some of which move, on a floor: the same range, link, shape and normal.
TEST(RayFan, ScansEqualTheReference) {
  int hits = 0, movers = 0;
  for (uint64_t seed = 0; seed < 60; ++seed) {
    RandomStream random = RandomSource(10, "rays", "scans").stream(seed);
    World world;
    world.add(at({0, 0, -1}), plane({0, 0, 1}));
    const int count = seed % 3 == 0 ? 400 : 40;  // many are more than a fan holds
    for (int i = 0; i < count; ++i) {
      constexpr Shape kShapes[] = {Shape::box, Shape::cylinder, Shape::sphere, Shape::cone};
      const Vec3 size = Vec3::Constant(0.3) + random_vector(random, 0.25);
      Pose pose = random_pose(random, 8.0);
      if (i % 2) pose.rotation = Quat::Identity();
      world.add(pose, geometry(kShapes[random.bits() % 4], size), random.bits() % 3 != 0);
    }
    const world::BodyLayout layout(world.model);
    const auto fast = make_ray_scene(make_static_ray_scene(world.model, layout));
    const auto slow =
        make_ray_scene(make_static_ray_scene(world.model, layout, false, Backend::reference));
    for (const size_t n : {24, 181, 257, 700}) {
      const double range = seed % 5 == 0 ? 1e6 : 0.5 + 8.0 * random.uniform();
      const Vec3 origin = random_vector(random, 8.0);
      std::vector<Ray> rays;
      for (const Vec3& d : random_fan(random, n, 2 * M_PI)) rays.push_back({origin, d, range});
      std::vector<Hit> fans(n), singles(n);
      const LinkIndex ignored(random.bits() % layout.links.size());
      fast->cast(rays, fans, ignored);
      slow->cast(rays, singles, ignored);
      for (size_t i = 0; i < n; ++i) {
        ASSERT_EQ(fans[i].range, singles[i].range) << seed << " ray " << i << " of " << n;
        ASSERT_EQ(fans[i].link, singles[i].link);
        ASSERT_EQ(fans[i].shape, singles[i].shape);
        ASSERT_EQ(fans[i].normal, singles[i].normal);
        hits += fans[i].hit();
        movers += fans[i].hit() && layout.links[fans[i].link].body.valid();
      }
    }
  }
  EXPECT_GT(hits, 8000);
  EXPECT_GT(movers, 500);
}

}  // namespace
}  // namespace ruedo::scene
