// Places models into a world by hand: on the ground, without overlapping anything.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "world/model/world_model.h"

namespace ruedo::world {

// The current pose of a link of an instance, by their indices; empty: as in the world file.
using LinkPose = std::function<Pose(InstanceIndex instance, ModelLinkIndex link)>;

// The occupied space of a world. A query's cost depends only on things near the place, so that
// thousands of models can be placed one after another. Not thread-safe.
class Room {
 public:
  Room();
  explicit Room(const WorldModel& world, const LinkPose& now = {});
  ~Room();

  void add(const ModelInstance& instance);  // for an instance at its start pose

  // The height of the ground at (x, y), m: the highest static surface at most 0.5 m above the
  // lowest one there, so that ramps and steps count, but tables, walls and roofs do not. 0
  // without one. near_z: prefers a surface at most 0.5 m from it.
  double ground_height(double x, double y, std::optional<double> near_z = {}) const;

  // The same on the storey of a person whose origin is at z, somewhere between feet and hips. If
  // there is no ground below, the result is z, or 0 if z may be the height of the hips.
  double floor_height(double x, double y, double z) const;

  // The pose of a model at (x, y) with that yaw, its lowest collision point on the ground. It is
  // level, unless the model would then stick in ground that is close to a plane: it is then tilted
  // with the ground.
  Pose standing_on(const Model& model, double x, double y, double yaw,
                   std::optional<double> near_z = {}) const;

  // The name of a model that the model's collisions would overlap, ignoring the lowest 2 cm above
  // the ground; "" if there is room. Static models may overlap each other. Meshes of the placed
  // model count as their convex hulls.
  std::string overlapped(const Model& model, const Pose& X_WM) const;

 private:
  std::vector<double> surfaces(double x, double y) const;
  std::optional<Pose> on_slope(const Model& model, const Pose& level, double lowest,
                               std::optional<double> near_z) const;

  struct Index;
  std::unique_ptr<Index> index_;
};

// The same, for a single query.
double ground_height(const WorldModel& world, double x, double y);
Pose standing_on(const WorldModel& world, const Model& model, double x, double y, double yaw,
                 std::optional<double> near_z = {});
std::string overlapped(const WorldModel& world, const Model& model, const Pose& X_WM,
                       const LinkPose& now = {});

// Robots that overlap something at the start: the solver would push them out at any speed. As
// overlapped(), and therefore the same ones that --spawn refuses.
void name_stuck_robots(const WorldModel& world, Findings& findings);

// The radius (m) of the smallest vertical cylinder around the model's base (its origin, if it has
// no drive) that contains its collisions.
double footprint_radius(const Model& model);

}  // namespace ruedo::world
