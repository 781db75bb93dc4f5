// All shapes that rays can hit, ordered by link and shape, each with its pose in the frame F that
// carries it: the world for static links, the body's frame for movers. Built once and shared by all
// backends.
#pragma once

#include <bit>
#include <map>
#include <memory>
#include <span>
#include <tuple>
#include <vector>

#include "scene/rays/ray_grid.h"
#include "scene/rays/ray_mesh.h"
#include "world/model/body_layout.h"

namespace ruedo::scene {

// Maps frame F to a shape's frame S: p_S = rotation * p_F + translation.
struct IntoShape {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Vec3 translation = Vec3::Zero();

  IntoShape() = default;
  explicit IntoShape(const Pose& X_FS)
      : rotation(X_FS.rotation.conjugate().toRotationMatrix()),
        translation(-(rotation * X_FS.translation)) {}
  Vec3 point(const Vec3& p_F) const { return rotation * p_F + translation; }
  Vec3 vector(const Vec3& v_F) const { return rotation * v_F; }
  Vec3 vector_back(const Vec3& v_S) const { return rotation.transpose() * v_S; }
};

using TurningIndex = Index<struct TurningKind>;  // into RayTable::turning

struct RayShape {
  world::Shape kind = world::Shape::box;
  LinkIndex link;               // as in Hit
  ShapeIndex shape;             // likewise
  BodyIndex body;               // none: static
  TurningIndex turning;         // its pose depends on a wheel's angle; none: it does not
  IntoShape into;               // at wheel angle 0
  Vec3 size = Vec3::Zero();     // box: half lengths; sphere, cylinder, capsule, cone: radius, half
                                // length; ellipsoid: radii
  Vec3 normal = Vec3::UnitZ();  // plane
  std::shared_ptr<const RayMesh> mesh;  // of a mesh: this, or a height map
  std::shared_ptr<const RayGrid> grid;
  Box box_F;                     // bounds at every wheel angle; empty for a plane
  Vec3 center_F = Vec3::Zero();  // bounding sphere, likewise
  double radius = 0.0;
};

// A shape that is not rotationally symmetric about its wheel's axis.
struct TurningShape {
  WheelIndex wheel;
  Pose X_FL, X_LS;  // at angle 0
  Vec3 axis_in_L = Vec3::UnitY();
  Vec3 center_in_L = Vec3::Zero();  // a point on the axis

  IntoShape at(double angle_rad) const {
    const Quat turn(Eigen::AngleAxisd(angle_rad, axis_in_L));
    return IntoShape(X_FL * Pose{turn, center_in_L - turn * center_in_L} * X_LS);
  }
};

struct RayTable {
  std::vector<RayShape> shapes;                       // by (link, shape)
  IndexedVector<BodyIndex, std::vector<int>> bodies;  // indices into shapes
  std::vector<int> statics;                           // indices into shapes
  IndexedVector<TurningIndex, TurningShape> turning;

  // Meshes of static links are given in the world's frame, without a tree. Those of movers are
  // shared and have one; device null: no tree.
  RayTable(const world::WorldModel& world, const world::BodyLayout& layout, bool visuals,
           RTCDevice device);

 private:
  void add(const world::LinkPlacement& link, LinkIndex link_index, ShapeIndex shape_index,
           const Pose& X_LS, const world::Geometry& geometry, const world::BodyLayout& layout,
           bool visuals, RTCDevice device);
  // With X_FS: its own mesh in frame F, without a tree; otherwise a shared one.
  std::shared_ptr<const RayMesh> mesh_of(const world::Geometry& geometry, const Pose* X_FS,
                                         RTCDevice device);
  // Marks shapes moved by a wheel: they get an entry in `turning`, and bounds for all that they
  // sweep.
  void add_turning(RayShape& shape, const Pose& X_LS, const world::LinkPlacement& link,
                   const world::BodyLayout& layout);
  std::map<std::tuple<const world::Mesh*, double, double, double>, std::shared_ptr<const RayMesh>>
      meshes_;
};

// Eight rays, and the nearest known hit of each.
struct RayBatch {
  static constexpr int kNothing = std::numeric_limits<int>::max();

  FrameRays world;
  double t[kLanes];   // nearest hit, or the maximum range
  int shape[kLanes];  // index into RayTable::shapes; kNothing: no hit yet
  int feature[kLanes];
  LinkIndex ignored_link;

  // The last origin tested against the static closed meshes, and the first mesh that contains it.
  bool asked_statics = false;
  Vec3 asked_at = Vec3::Zero();
  int inside_static = kNothing;

  // Keeps the nearer hit; among equals that of the lower shape and feature.
  void offer(int lane, const ShapeHit& hit, int index) {
    if (hit.t < t[lane] ||
        (hit.t == t[lane] && hit.t < kNoHit &&
         (index < shape[lane] || (index == shape[lane] && hit.feature < feature[lane])))) {
      t[lane] = hit.t;
      shape[lane] = index;
      feature[lane] = hit.feature;
    }
  }

  // Caches whether a point is inside a closed mesh: the rays of one device ask again and again.
  bool inside_mesh(const RayShape& shape, int index, const Vec3& p_F, const Vec3& p_S);

 private:
  struct Asked {
    int index = -1;
    Vec3 p_F;
    bool inside;
  };
  Asked asked_[4];
  int oldest_ = 0;
};

// Tests the lanes (bits) of rays in frame F against a shape.
void test_shape(const RayShape& shape, int index, const IntoShape& into, unsigned lanes,
                const FrameRays& rays, RayBatch& batch);

// Outward normal in the shape's frame at a point of its surface.
Vec3 shape_normal(const RayShape& shape, int feature, const Vec3& p_S);

// Whether the ray comes near the shape's bounding sphere.
inline bool near_ball(const RayShape& shape, const Vec3& o, const Vec3& d) {
  const Vec3 to_center = shape.center_F - o;
  const double along = to_center.dot(d);
  const double squared = to_center.squaredNorm(), radius2 = shape.radius * shape.radius;
  return squared <= radius2 || (along > 0.0 && squared - along * along <= radius2);
}

}  // namespace ruedo::scene
