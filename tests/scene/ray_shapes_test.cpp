// Each shape against ranges and normals worked out by hand, alone in the world, by both casters and
// through packets.
#include <array>

#include <gtest/gtest.h>

#include "ray_worlds.h"

namespace ruedo::scene {
namespace {

using world::Shape;
constexpr double kNothing = std::numeric_limits<double>::infinity();
const double kHalf = std::sqrt(0.5);

struct Case {
  const char* what;
  world::Geometry shape;
  Pose pose;
  Vec3 origin, direction;
  double range;
  Vec3 normal;
};

const world::Geometry kBox = geometry(Shape::box, {2, 4, 6});
const world::Geometry kBall = geometry(Shape::sphere, {2, 0, 0});
const world::Geometry kCylinder = geometry(Shape::cylinder, {1, 4, 0});  // z from -2 to 2
const world::Geometry kCapsule = geometry(Shape::capsule, {1, 4, 0});    // z from -3 to 3
const world::Geometry kEllipsoid = geometry(Shape::ellipsoid, {1, 2, 3});
const world::Geometry kCone =
    geometry(Shape::cone, {1, 2, 0});  // apex at z 1, base at z -1; half as wide at z 0
const Pose kTurned = Pose::from_xyz_rpy({10, 0, 0}, {0, 0, M_PI / 4});
const double kSlope = std::sqrt(5.0);

std::vector<Case> cases() {
  return {
      {"box, front", kBox, {}, {-5, 0, 0}, {1, 0, 0}, 4, {-1, 0, 0}},
      {"box, other side", kBox, {}, {5, 1, 1}, {-1, 0, 0}, 4, {1, 0, 0}},
      {"box, from above", kBox, {}, {0.5, -1.5, 7}, {0, 0, -1}, 4, {0, 0, 1}},
      {"box, slanted: enters x = -1 at y = 1",
       kBox,
       {},
       {-2, 0, 0},
       {kHalf, kHalf, 0},
       std::sqrt(2.0),
       {-1, 0, 0}},
      {"box, slanted past the edge", kBox, {}, {-3, 1.5, 0}, {kHalf, kHalf, 0}, kNothing, {}},
      {"box, beside", kBox, {}, {-5, 2.001, 0}, {1, 0, 0}, kNothing, {}},
      {"box, behind", kBox, {}, {5, 0, 0}, {1, 0, 0}, kNothing, {}},
      {"box, inside", kBox, {}, {0.5, 0.5, 0.5}, {1, 0, 0}, 0, {-1, 0, 0}},
      {"box turned by 45 deg: corner at 10 - sqrt(2)",
       geometry(Shape::box, {2, 2, 2}),
       kTurned,
       {0, 0.25, 0},
       {1, 0, 0},
       10.25 - std::sqrt(2.0),
       {-kHalf, kHalf, 0}},
      {"sphere", kBall, {}, {-5, 0, 0}, {1, 0, 0}, 3, {-1, 0, 0}},
      {"sphere, off centre: sqrt(4 - 1)",
       kBall,
       {},
       {-5, 1, 0},
       {1, 0, 0},
       5 - std::sqrt(3.0),
       {-std::sqrt(3.0) / 2, 0.5, 0}},
      {"sphere, missed", kBall, {}, {-5, 2.0001, 0}, {1, 0, 0}, kNothing, {}},
      {"sphere, from 30 km",
       kBall,
       {},
       {-30000, 1, 0},
       {1, 0, 0},
       30000 - std::sqrt(3.0),
       {-std::sqrt(3.0) / 2, 0.5, 0}},
      {"sphere, inside", kBall, {}, {1, 1, 1}, {0, 1, 0}, 0, {0, -1, 0}},
      {"cylinder, wall", kCylinder, {}, {-5, 0, 1.9}, {1, 0, 0}, 4, {-1, 0, 0}},
      {"cylinder, wall off centre: cos 30",
       kCylinder,
       {},
       {-5, 0.5, 0},
       {1, 0, 0},
       5 - std::sqrt(0.75),
       {-std::sqrt(0.75), 0.5, 0}},
      {"cylinder, top", kCylinder, {}, {0.6, 0.6, 5}, {0, 0, -1}, 3, {0, 0, 1}},
      {"cylinder, beside the top", kCylinder, {}, {0.8, 0.8, 5}, {0, 0, -1}, kNothing, {}},
      {"cylinder, over it", kCylinder, {}, {-5, 0, 2.1}, {1, 0, 0}, kNothing, {}},
      {"cylinder, slanted through the bottom",
       kCylinder,
       {},
       {-1.5, 0, -3},
       {kHalf, 0, kHalf},
       std::sqrt(2.0),
       {0, 0, -1}},
      {"cylinder, inside", kCylinder, {}, {0, 0, 1.9}, {0, 0, 1}, 0, {0, 0, -1}},
      {"capsule, wall", kCapsule, {}, {-5, 0, 2}, {1, 0, 0}, 4, {-1, 0, 0}},
      {"capsule, top ball at z 2.5: sqrt(0.75)",
       kCapsule,
       {},
       {-5, 0, 2.5},
       {1, 0, 0},
       5 - std::sqrt(0.75),
       {-std::sqrt(0.75), 0, 0.5}},
      {"capsule, from below", kCapsule, {}, {0, 0, -5}, {0, 0, 1}, 2, {0, 0, -1}},
      {"capsule, inside the ball only", kCapsule, {}, {0, 0, 2.9}, {1, 0, 0}, 0, {-1, 0, 0}},
      {"capsule, beside the ball", kCapsule, {}, {-5, 0.8, 2.8}, {1, 0, 0}, kNothing, {}},
      {"ellipsoid, x", kEllipsoid, {}, {-5, 0, 0}, {1, 0, 0}, 4, {-1, 0, 0}},
      {"ellipsoid, z", kEllipsoid, {}, {0, 0, 5}, {0, 0, -1}, 2, {0, 0, 1}},
      {"ellipsoid, at y 1: x = sqrt(3)/2",
       kEllipsoid,
       {},
       {-5, 1, 0},
       {1, 0, 0},
       5 - std::sqrt(0.75),
       Vec3(-std::sqrt(0.75), 0.25, 0).normalized()},
      {"ellipsoid, inside", kEllipsoid, {}, {0, 0, 2.9}, {1, 0, 0}, 0, {-1, 0, 0}},
      {"cone, wall", kCone, {}, {-5, 0, 0}, {1, 0, 0}, 4.5, {-2 / kSlope, 0, 1 / kSlope}},
      {"cone, base", kCone, {}, {0.5, 0.5, -3}, {0, 0, 1}, 2, {0, 0, -1}},
      {"cone, from above: z = 1 - 2 * 0.25",
       kCone,
       {},
       {0.25, 0, 3},
       {0, 0, -1},
       2.5,
       {2 / kSlope, 0, 1 / kSlope}},
      {"cone, beside the base", kCone, {}, {0.8, 0.8, 3}, {0, 0, -1}, kNothing, {}},
      {"cone, the mirror image over the apex is not there",
       kCone,
       {},
       {-5, 0, 1.5},
       {1, 0, 0},
       kNothing,
       {}},
      {"cone, parallel to the wall, into the base",
       kCone,
       {},
       {0.5 - 1 / kSlope, 0, -1 - 2 / kSlope},
       {1 / kSlope, 0, 2 / kSlope},
       1,
       {0, 0, -1}},
      {"cone, parallel to the wall, from above",
       kCone,
       {},
       {0.25 + 1 / kSlope, 0, -0.5 + 2 / kSlope},
       {-1 / kSlope, 0, -2 / kSlope},
       1 - kSlope / 4,
       {2 / kSlope, 0, 1 / kSlope}},
      {"cone, parallel to the wall, outside",
       kCone,
       {},
       {-3, 0, -3},
       {1 / kSlope, 0, 2 / kSlope},
       kNothing,
       {}},
      {"cone, inside", kCone, {}, {0, 0, 0.9}, {1, 0, 0}, 0, {-1, 0, 0}},
      {"plane from above",
       plane({0, 0, 1}),
       at({7, 7, -1}),
       {0, 0, 1},
       {0, kHalf, -kHalf},
       2 * std::sqrt(2.0),
       {0, 0, 1}},
      {"plane from below", plane({0, 0, 1}), {}, {0, 0, -1}, {0, 0, 1}, 1, {0, 0, -1}},
      {"plane, along it", plane({0, 0, 1}), {}, {0, 0, 1}, {1, 0, 0}, kNothing, {}},
      {"plane, upright", plane({-1, 0, 0}), at({3, 0, 0}), {0, 0, 1}, {1, 0, 0}, 3, {-1, 0, 0}},
      {"mesh", mesh_geometry(cube_mesh()), {}, {-5, 0.3, 0.2}, {1, 0, 0}, 4, {-1, 0, 0}},
      {"mesh, scaled by 2 3 4",
       mesh_geometry(cube_mesh(), {2, 3, 4}),
       {},
       {0.1, -9, 0.2},
       {0, 1, 0},
       6,
       {0, -1, 0}},
      {"mesh, mirrored",
       mesh_geometry(cube_mesh(), {-2, 1, 1}),
       {},
       {-5, 0.3, 0.2},
       {1, 0, 0},
       3,
       {-1, 0, 0}},
      {"mesh, inside", mesh_geometry(cube_mesh()), {}, {0.9, 0, 0}, {1, 0, 0}, 0, {-1, 0, 0}},
      {"mesh, mirrored, inside",
       mesh_geometry(cube_mesh(), {-2, 1, 1}),
       {},
       {1.9, 0, 0},
       {1, 0, 0},
       0,
       {-1, 0, 0}},
      {"open mesh has no inside",
       mesh_geometry(opened(*cube_mesh())),
       {},
       {0.5, 0, 0},
       {1, 0, 0},
       0.5,
       {-1, 0, 0}},
  };
}

// One ray alone, and the same in a packet between others.
void expect_case(const Case& c, const RayScene& scene, const char* how) {
  const Ray ray{c.origin, c.direction};
  std::array<Ray, 11> rays;
  rays.fill({{50, 50, 50}, {0, 0, 1}});
  rays[3] = rays[10] = ray;
  std::array<Hit, 11> hits;
  scene.cast(rays, hits);
  for (const Hit& hit : {scene.cast(ray), hits[3], hits[10]}) {
    ASSERT_EQ(hit.hit(), c.range < kNothing) << c.what << how << hit.range;
    if (!hit.hit()) continue;
    EXPECT_NEAR(hit.range, c.range, 1e-12 * std::max(1.0, c.range)) << c.what << how;
    EXPECT_NEAR((hit.normal - c.normal).norm(), 0.0, 1e-9)
        << c.what << how << hit.normal.transpose();
  }
  EXPECT_FALSE(hits[0].hit());
}

TEST(RayShapes, HandComputed) {
  for (const Case& c : cases())
    for (const bool is_static : {true, false})
      for (const Backend backend : {Backend::embree, Backend::reference}) {
        World world;
        world.add(c.pose, c.shape, is_static);
        const world::BodyLayout layout(world.model);
        const auto scene =
            make_ray_scene(make_static_ray_scene(world.model, layout, false, backend));
        expect_case(c, *scene, is_static ? ", static " : ", mover ");
      }
}

// The same shapes by their implicit equations, which share nothing with the ray tests.
bool solid(Shape shape, const Vec3& s, const Vec3& p) {
  const double around = std::hypot(p.x(), p.y());
  switch (shape) {
    case Shape::box: return (p.cwiseAbs().array() <= 0.5 * s.array()).all();
    case Shape::sphere: return p.norm() <= s.x();
    case Shape::cylinder: return around <= s.x() && std::abs(p.z()) <= s.y() / 2;
    case Shape::capsule:
      return (p - Vec3(0, 0, std::clamp(p.z(), -s.y() / 2, s.y() / 2))).norm() <= s.x();
    case Shape::ellipsoid: return p.cwiseQuotient(s).norm() <= 1.0;
    case Shape::cone:
      return std::abs(p.z()) <= s.y() / 2 && around <= s.x() * (0.5 - p.z() / s.y());
    default: return false;
  }
}

TEST(RayShapes, MatchImplicitEquations) {
  RandomStream random = RandomSource(3, "rays", "implicit").stream(0);
  for (const Shape shape : {Shape::box, Shape::sphere, Shape::cylinder, Shape::capsule,
                            Shape::ellipsoid, Shape::cone}) {
    int hits = 0;
    for (int i = 0; i < 400; ++i) {
      const Vec3 size(0.2 + random.uniform(), 0.2 + random.uniform(), 0.2 + random.uniform());
      const Pose pose = random_pose(random, 3.0);
      World world;
      world.add(pose, geometry(shape, size));
      const world::BodyLayout layout(world.model);
      const auto scene = make_ray_scene(make_static_ray_scene(world.model, layout));
      const Vec3 origin = random_vector(random, 4.0);
      const Vec3 direction = (pose * random_vector(random, 0.7) - origin).normalized();
      const Hit hit = scene->cast({origin, direction, 12.0});
      hits += hit.hit();
      const auto in = [&](double t) {
        return solid(shape, size, pose.inverse() * (origin + t * direction));
      };
      if (hit.range == 0.0) {
        EXPECT_TRUE(in(0.0));
        continue;
      }
      // Nothing solid before the hit, the surface within 1e-9 of it.
      const double end = hit.hit() ? hit.range - 1e-9 : 12.0;
      for (int k = 0; k <= 600; ++k)
        ASSERT_FALSE(in(end * k / 600)) << "shape " << static_cast<int>(shape) << " ray " << i;
      if (hit.hit() && std::abs(hit.normal.dot(direction)) > 1e-3) {
        EXPECT_TRUE(in(hit.range + 1e-9));
      }
    }
    EXPECT_GT(hits, 150);
  }
}

}  // namespace
}  // namespace ruedo::scene
