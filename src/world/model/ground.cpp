// Support heights of shapes, in closed form.
#include "world/model/ground.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "ruedo/math.h"
#include "world/model/height_grid.h"

namespace ruedo::world {

namespace {

template <class Visit>
void for_each_level_plane(const WorldModel& world, const BodyLayout& layout, Visit visit) {
  for (const LinkIndex link : layout.links.indices()) {
    const auto& placement = layout.links[link];
    const auto& instance = world.models[placement.instance];
    if (placement.body.valid() || instance.removed) continue;
    for (const auto& collision : instance.model->links[placement.link].collisions) {
      if (collision.geometry.shape != Shape::plane) continue;
      const Pose X_WC = placement.X_BL * collision.X_LC;
      const Vec3 normal = X_WC.rotation * collision.geometry.normal;
      if (normal.z() > 1.0 - 1e-12)
        visit(LevelPlane{X_WC.translation.z(), collision.surface.friction, link});
    }
  }
}

// Keeps the plane that is nearer to that height.
void keep_nearer(double height, const LevelPlane& plane, std::optional<LevelPlane>& nearest) {
  if (!nearest || std::abs(plane.height - height) < std::abs(nearest->height - height))
    nearest = plane;
}

}  // namespace

std::vector<LevelPlane> level_planes(const WorldModel& world, const BodyLayout& layout) {
  std::vector<LevelPlane> planes;
  for_each_level_plane(world, layout, [&](const LevelPlane& plane) { planes.push_back(plane); });
  return planes;
}

std::optional<LevelPlane> nearest_plane(const std::vector<LevelPlane>& planes, double height) {
  std::optional<LevelPlane> nearest;
  for (const LevelPlane& plane : planes) keep_nearer(height, plane, nearest);
  return nearest;
}

std::optional<LevelPlane> nearest_plane(const WorldModel& world, const BodyLayout& layout,
                                        double height) {
  std::optional<LevelPlane> nearest;
  for_each_level_plane(world, layout,
                       [&](const LevelPlane& plane) { keep_nearer(height, plane, nearest); });
  return nearest;
}

double lowest_point(const Geometry& geometry, const Pose& X_FC) {
  const Vec3 down = X_FC.rotation.conjugate() * -Vec3::UnitZ();  // in C
  const Vec3& size = geometry.size;
  const double across = math::hypot(down.x(), down.y());
  double reach = 0.0;
  switch (geometry.shape) {
    case Shape::box: reach = 0.5 * down.cwiseAbs().dot(size); break;
    case Shape::sphere: reach = size.x(); break;
    case Shape::cylinder: reach = size.x() * across + 0.5 * size.y() * std::abs(down.z()); break;
    case Shape::capsule: reach = size.x() + 0.5 * size.y() * std::abs(down.z()); break;
    case Shape::ellipsoid: reach = down.cwiseProduct(size).norm(); break;
    case Shape::cone:
      reach = std::max(0.5 * size.y() * down.z(), size.x() * across - 0.5 * size.y() * down.z());
      break;
    case Shape::plane: break;
    case Shape::mesh:
      reach = -std::numeric_limits<double>::infinity();
      if (!geometry.mesh) break;
      for_each_vertex(*geometry.mesh, [&](const Eigen::Vector3f& position) {
        reach = std::max(reach, down.dot(position.cast<double>().cwiseProduct(geometry.scale)));
      });
      break;
  }
  return X_FC.translation.z() - reach;
}

double friction_of_wheels(const WorldModel& world, const BodyLayout& layout, RobotIndex robot) {
  const auto& placement = layout.robots[robot];
  const auto& model = *world.models[placement.instance].model;
  double least = std::numeric_limits<double>::infinity();
  for (const WheelIndex wheel : placement.wheels) {
    const auto& link = layout.links[layout.wheels[wheel].link];
    for (const auto& collision : model.links[link.link].collisions)
      least = std::min(least, collision.surface.friction);
  }
  return std::isfinite(least) ? least : 1.0;
}

namespace {

// Whether a sliding joint carries the wheel, whose spring presses it down.
bool is_suspended(const Model& model, ModelJointIndex wheel) {
  ModelLinkIndex at = model.joints[wheel].parent;
  for (size_t steps = 0; at.valid() && steps <= model.joints.size(); ++steps) {
    const auto above = std::find_if(model.joints.begin(), model.joints.end(),
                                    [&](const Joint& each) { return each.child == at; });
    if (above == model.joints.end()) return false;
    if (above->type == JointType::prismatic) return true;
    at = above->parent;
  }
  return false;
}

}  // namespace

double lowest_of_wheels(const WorldModel& world, const BodyLayout& layout, RobotIndex robot) {
  const auto& placement = layout.robots[robot];
  const auto& model = *world.models[placement.instance].model;
  const Pose X_BaseB = placement.X_BBase.inverse();
  const Pose X_BaseW = X_BaseB * layout.bodies[placement.body].X_WB.inverse();
  double lowest = std::numeric_limits<double>::infinity();
  const auto include = [&](const LinkPlacement& link) {
    const Pose X_BaseL = X_BaseW * layout.bodies[link.body].X_WB * link.X_BL;
    for (const auto& collision : model.links[link.link].collisions)
      lowest = std::min(lowest, lowest_point(collision.geometry, X_BaseL * collision.X_LC));
    return X_BaseL;
  };
  bool suspended = !placement.wheels.empty();
  for (const WheelIndex wheel : placement.wheels) {
    if (layout.wheels[wheel].steers) continue;
    const auto& link = layout.links[layout.wheels[wheel].link];
    const Pose X_BaseL = include(link);
    if (model.links[link.link].collisions.empty())
      lowest = std::min(lowest, X_BaseL.translation.z() - model.drive->wheel_radius);
    suspended = suspended && is_suspended(model, layout.wheels[wheel].joint);
  }
  if (suspended) {  // the casters carry the robot, and the wheels reach down beside them
    for (const LinkIndex link : layout.bodies[placement.body].links) include(layout.links[link]);
  }
  return std::isfinite(lowest) ? lowest : 0.0;
}

}  // namespace ruedo::world
