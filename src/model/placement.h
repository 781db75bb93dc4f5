// Putting models into a world by hand: on the ground, and not into something else.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/world_model.h"

namespace ruedo::model {

// The pose of a link of an instance now, by their indices; empty: where the world file puts it.
using LinkPose = std::function<Pose(InstanceIndex instance, ModelLinkIndex link)>;

// What stands where in a world. A question costs what is near the place, so that thousands of
// models can be placed one after another. Not for several threads at once.
class Room {
 public:
  Room();
  explicit Room(const WorldModel& world, const LinkPose& now = {});
  ~Room();

  void add(const ModelInstance& instance);  // one that stands where it was put

  // The height of the ground at (x, y), metres: the highest static surface that lies at most 0.5 m
  // above the lowest one there, so that ramps and steps count and tables, walls and roofs do not. 0
  // where there is nothing.
  double ground_height(double x, double y) const;

  // The same of the storey on which a person stands whose origin is at z, somewhere between his
  // feet and his hips. Where nothing is below him he stands at z, or at 0 where that may be his
  // hips'.
  double floor_height(double x, double y, double z) const;

  // The pose of a model at (x, y) with that yaw, its lowest collision point on the ground. Level,
  // or where it would stick in the ground then and that is as good as a plane, tilted as the ground
  // is.
  Pose standing_on(const Model& model, double x, double y, double yaw) const;

  // The name of a model whose collisions the model would share space with, 2 cm of it from the
  // ground up left out;
  // "" when there is room. Static models may stand in each other. Meshes of the placed model count
  // as their convex hulls.
  std::string overlapped(const Model& model, const Pose& X_WM) const;

 private:
  std::vector<double> surfaces(double x, double y) const;
  std::optional<Pose> on_slope(const Model& model, const Pose& level, double lowest) const;

  struct Index;
  std::unique_ptr<Index> index_;
};

// The same for a single question.
double ground_height(const WorldModel& world, double x, double y);
Pose standing_on(const WorldModel& world, const Model& model, double x, double y, double yaw);
std::string overlapped(const WorldModel& world, const Model& model, const Pose& X_WM,
                       const LinkPose& now = {});

// Robots that share space with something at the start: the solver pushes them out of it, at any
// speed. As overlapped(), and so what --spawn refuses.
void name_stuck_robots(const WorldModel& world, Findings& findings);

// The radius of the smallest upright cylinder about the model's base (its origin, without a drive)
// that holds its collisions, metres.
double footprint_radius(const Model& model);

}  // namespace ruedo::model
