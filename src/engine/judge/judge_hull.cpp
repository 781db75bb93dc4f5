// The hull of a robot that stands alone, and rays out from it.
#include "engine/judge/judge_hull.h"

#include <numbers>

#include "ruedo/math.h"

namespace ruedo::judge {
namespace {

constexpr int kDirections = 180, kHeights = 5;
constexpr double kFar = 5.0;      // m, beyond every robot's hull
constexpr double kLowest = 0.03;  // m above the ground: the ground itself is no obstacle
constexpr double kHighest = 2.0;  // m

scene::Hit inward(const scene::RayScene& scene, const Vec3& direction, double height) {
  const Vec3 origin = kFar * direction + Vec3(0, 0, height);
  return scene.cast({origin, -direction, kFar});
}

Vec3 direction_of(int i) {
  const double angle = 2.0 * std::numbers::pi * i / kDirections;
  return {math::cos(angle), math::sin(angle), 0.0};
}

}  // namespace

JudgeHull::JudgeHull(const world::WorldModel& world, const world::BodyLayout& layout,
                     RobotIndex robot)
    : layout_(layout), robot_(robot) {
  find_hull(world);
  scene_ = scene::make_ray_scene(scene::make_static_ray_scene(world, layout));
}

// The robot alone, with base_link at the origin.
void JudgeHull::find_hull(const world::WorldModel& world) {
  world::WorldModel alone;
  alone.models.push_back(world.models[layout_.robots[robot_].instance]);
  const world::BodyLayout layout(alone);
  const world::RobotPlacement& placement = layout.robots.at(0);
  Snapshot still;
  for (const world::BodyPlacement& body : layout.bodies) still.bodies.push_back(body.X_WB);
  still.wheel_angles.resize(layout.wheels.size());
  const Pose X_BaseW = (placement.body.valid() ? still.bodies[placement.body] * placement.X_BBase
                                               : placement.X_BBase)
                           .inverse();
  for (Pose& pose : still.bodies) pose = X_BaseW * pose;
  const auto scene = scene::make_ray_scene(scene::make_static_ray_scene(alone, layout));
  scene->update(still);
  double top = kLowest;
  for (double height = kLowest; height < kHighest; height += 0.01) {
    for (int i = 0; i < kDirections; i += 5) {
      if (inward(*scene, direction_of(i), height).hit()) top = height;
    }
  }
  for (int level = 0; level < kHeights; ++level) {
    const double height = kLowest + (top - kLowest) * level / (kHeights - 1);
    for (int i = 0; i < kDirections; ++i) {
      const scene::Hit hit = inward(*scene, direction_of(i), height);
      if (hit.hit())
        hull_.push_back(
            {(kFar - hit.range) * direction_of(i) + Vec3(0, 0, height), direction_of(i)});
    }
  }
  rays_.resize(hull_.size());
  hits_.resize(hull_.size());
}

JudgeHull::Nearest JudgeHull::nearest(const Snapshot& snapshot, double reach) {
  scene_->update(snapshot);
  const Pose& X_WBase = snapshot.robots[robot_].X_WBase;
  const InstanceIndex instance = layout_.robots[robot_].instance;
  for (size_t i = 0; i < hull_.size(); ++i)
    rays_[i] = {X_WBase * hull_[i].origin, X_WBase.rotation * hull_[i].direction, reach};
  scene_->cast(rays_, hits_);
  Nearest nearest;
  for (const scene::Hit& hit : hits_) {
    if (!hit.hit() || layout_.links[hit.link].instance == instance || hit.range >= nearest.range)
      continue;
    nearest = {hit.range, hit.link};
  }
  return nearest;
}

}  // namespace ruedo::judge
