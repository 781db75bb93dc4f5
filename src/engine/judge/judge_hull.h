// How far a robot's hull is from everything else, by horizontal rays.
//
// The hull is found once, by rays towards a robot that stands alone; then rays go out from it, in
// every second degree and at five heights. An obstacle that is thinner than the gap between rays
// may be missed while it is far.
#pragma once

#include <memory>
#include <vector>

#include "scene/ray_scene.h"
#include "world/model/body_layout.h"

namespace ruedo::judge {

class JudgeHull {
 public:
  JudgeHull(const world::WorldModel& world, const world::BodyLayout& layout, RobotIndex robot);

  struct Nearest {
    double range = std::numeric_limits<double>::infinity();  // m
    LinkIndex link;                                          // of what is nearest
  };
  // The nearest thing within `reach` (m) of the hull.
  Nearest nearest(const Snapshot& snapshot, double reach);

 private:
  void find_hull(const world::WorldModel& world);

  const world::BodyLayout& layout_;
  RobotIndex robot_;
  std::vector<scene::Ray> hull_;  // in base_link: points on the hull, directions outwards
  std::unique_ptr<scene::RayScene> scene_;
  std::vector<scene::Ray> rays_;
  std::vector<scene::Hit> hits_;
};

}  // namespace ruedo::judge
