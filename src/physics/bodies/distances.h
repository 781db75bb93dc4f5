// How far a model is from everything else: from its collision shapes, as its links stand, to those
// of all other models of the world.
//
// The shapes are those that physics collides: primitives, tyres, static meshes as triangles, moving
// meshes (and all of the model itself) as the convex hulls of their connected parts. Distances are
// exact to 1e-6 m. Of a P3-AT and everything within 1 m, a call takes 20 us in worlds/arena.sdf and
// worlds/maze.sdf.
//
// The robot's ground does not count: a triangle or convex shape whose nearest point is lower than
// 2 cm above base_link's plane and lies below (the direction to the robot is within 45 degrees of
// base_link's z axis), or on a triangle or side of a box that faces upwards so and is level with
// that plane or clearly below: the next tile of a floor and the foot of a ramp are no obstacles. A
// model without a drive has no base_link: everything counts.
#pragma once

#include <limits>
#include <memory>

#include "ruedo/snapshot.h"
#include "world/model/body_layout.h"

namespace ruedo::physics {

// Not thread safe. Equal snapshots have equal results, whatever calls came before.
class Distances {
 public:
  // world and layout must outlive it. Models that are added to them later are not known.
  Distances(const world::WorldModel& world, const world::BodyLayout& layout, InstanceIndex of);
  ~Distances();

  struct Nearest {
    // m; +inf: nothing within reach; 0: they touch or overlap
    double distance = std::numeric_limits<double>::infinity();
    LinkIndex own, other;
    Vec3 own_point = Vec3::Zero(), other_point = Vec3::Zero();  // world
  };
  // The nearest thing within `reach` (m). A contact of the snapshot is a distance of 0.
  Nearest nearest(const Snapshot& snapshot, double reach);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ruedo::physics
