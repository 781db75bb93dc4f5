// Bounding boxes choose the pairs of shapes, the nearest first; GJK measures those whose boxes are
// nearer than the best so far.
#include "physics/bodies/distances.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include <BulletCollision/CollisionShapes/btTriangleShape.h>

#include "physics/bodies/rigid_bodies.h"
#include "physics/collision/closest_points.h"
#include "physics/collision/mesh_edges.h"
#include "physics/collision/shapes.h"

namespace ruedo::physics {

namespace {

constexpr double kLow_m = 0.02;   // above base_link's plane: lower shapes may carry the robot
constexpr double kUpwards = 0.7;  // cosine, from base_link's z axis
constexpr double kRather = 0.1;   // cosine: a lower floor is below rather than beside
constexpr double kOnFace_m = 1e-5;
// Nearer than this, a gap's direction is rounding: the shape raised by kLow_m gives the direction.
constexpr double kTouches_m = 1e-3;

struct Box {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;

  void include(const Box& other) {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }
  double gap(const Box& other) const {
    return (other.low - high).cwiseMax(low - other.high).cwiseMax(0.0).norm();
  }
};

Box box_of(const btCollisionShape& shape, const btTransform& X) {
  btVector3 low, high;
  shape.getAabb(X, low, high);
  return {from_bt(low), from_bt(high)};
}

// A convex shape, a plane, or a mesh of triangles; of a link.
struct Piece {
  LinkIndex link;
  Pose X_LS;
  const btCollisionShape* shape = nullptr;
  btTransform X_WS;
  Vec3 center = Vec3::Zero(), half = Vec3::Zero();  // bounds in S

  Piece(LinkIndex of, const Pose& X_LC, btCollisionShape& made)
      : link(of), X_LS(X_LC), shape(&made) {
    // All shapes here have their true size without a margin, but those that are round.
    if (made.getShapeType() == BOX_SHAPE_PROXYTYPE ||
        made.getShapeType() == CYLINDER_SHAPE_PROXYTYPE)
      made.setMargin(0.0);
    const Box box = box_of(made, btTransform::getIdentity());
    center = (box.low + box.high) / 2.0;
    half = (box.high - box.low) / 2.0;
  }
  Box place(const Pose& X_WL) {
    X_WS = to_bt((X_WL * X_LS).normalized());
    if (shape->getShapeType() == STATIC_PLANE_PROXYTYPE) return box_of(*shape, X_WS);
    const btVector3 middle = X_WS * to_bt(center), h = to_bt(half);
    const btMatrix3x3 R = X_WS.getBasis().absolute();
    return {from_bt(middle - R * h), from_bt(middle + R * h)};
  }
  const btConvexShape& convex() const { return static_cast<const btConvexShape&>(*shape); }
};

// A surface that may carry a robot, in some frame.
struct Ground {
  bool any = false;
  btVector3 origin{0, 0, 0}, up{0, 0, 1};  // base_link's plane

  double height(const btVector3& point) const { return up.dot(point - origin); }
  bool upwards(const btVector3& normal) const { return normal.dot(up) > kUpwards; }
  bool carries(const ClosestPoints& gap, bool faces_up) const {
    const double at = height(gap.on_b);
    return any && at < kLow_m &&
           (upwards(gap.normal) || (faces_up && (at > -kLow_m || gap.normal.dot(up) > kRather)));
  }
  Ground seen_from(const btTransform& X_WM) const {
    return {any, X_WM.invXform(origin), up * X_WM.getBasis()};
  }
};

// Whether a point of the surface is on a face that faces upwards. Round shapes have none.
bool on_upper_face(const PlacedShape& b, const btVector3& point, const btVector3& up) {
  if (b.shape.getShapeType() != BOX_SHAPE_PROXYTYPE) return false;
  const btVector3 half = static_cast<const btBoxShape&>(b.shape).getHalfExtentsWithMargin(),
                  at = b.X.invXform(point), along = up * b.X.getBasis();
  for (int i = 0; i < 3; ++i) {
    if (std::abs(along[i]) > kUpwards &&
        half[i] - std::copysign(at[i], at[i] * along[i]) < kOnFace_m)
      return true;
  }
  return false;
}

}  // namespace

class Distances::Impl {
 public:
  Impl(const world::WorldModel& world, const world::BodyLayout& layout, InstanceIndex of);

  Nearest nearest(const Snapshot& snapshot, double reach);

 private:
  struct Candidate {
    double at_least;  // m
    size_t own, other;
  };
  class Triangles;

  void add(const world::WorldModel& world, LinkIndex link);
  Pose pose_of(LinkIndex link, const Snapshot& snapshot) const;
  bool touched(const Snapshot& snapshot);
  void place(const Snapshot& snapshot);
  void find_candidates(double reach);
  void measure(const Piece& own, const Piece& other);
  void measure_plane(const Piece& own, const Piece& plane);
  bool counts(const PlacedShape& own, const PlacedShape& other, const ClosestPoints& gap,
              const Ground& ground, bool faces_up) const;
  void keep(const Piece& own, const Piece& other, const ClosestPoints& gap);

  const world::BodyLayout& layout_;
  InstanceIndex of_;
  RobotIndex robot_;
  ShapeFactory shapes_{ShapeFactory::Hulls::exact};
  std::vector<Piece> own_, others_;  // the others: those that never move first
  std::vector<Box> own_boxes_, boxes_;
  size_t fixed_ = 0;
  Ground ground_;
  std::vector<Candidate> candidates_;
  double best_m_ = 0.0;
  Nearest nearest_;
};

Distances::Impl::Impl(const world::WorldModel& world, const world::BodyLayout& layout,
                      InstanceIndex of)
    : layout_(layout), of_(of) {
  for (const RobotIndex i : layout.robots.indices()) {
    if (layout.robots[i].instance == of) robot_ = i;
  }
  for (const bool moves : {false, true}) {
    for (const LinkIndex link : layout.links.indices()) {
      if (layout.links[link].body.valid() == moves) add(world, link);
    }
    if (!moves) fixed_ = others_.size();
  }
  own_boxes_.resize(own_.size());
  boxes_.resize(others_.size());
  for (size_t i = 0; i < fixed_; ++i)
    boxes_[i] = others_[i].place(layout.links[others_[i].link].X_BL);
}

void Distances::Impl::add(const world::WorldModel& world, LinkIndex link) {
  const world::LinkPlacement& placement = layout_.links[link];
  const bool own = placement.instance == of_;
  const bool wheel = placement.body.valid() && driven_wheel(layout_, placement.body).valid();
  std::vector<btCollisionShape*> shapes;
  for (const world::Collision& collision :
       world.models[placement.instance].model->links[placement.link].collisions) {
    const world::Geometry& geometry = collision.geometry;
    shapes.clear();
    if (wheel && geometry.shape == world::Shape::cylinder) {
      shapes.push_back(shapes_.tyre(geometry.size.x(), geometry.size.y()));
    } else if (own || placement.body.valid()) {
      shapes_.moving(geometry, wheel, shapes);
    } else if (btCollisionShape* shape = shapes_.fixed(geometry)) {
      shapes.push_back(shape);
    }
    for (btCollisionShape* shape : shapes)
      (own ? own_ : others_).emplace_back(link, collision.X_LC, *shape);
  }
}

Pose Distances::Impl::pose_of(LinkIndex link, const Snapshot& snapshot) const {
  const world::LinkPlacement& placement = layout_.links[link];
  if (!placement.body.valid()) return placement.X_BL;
  return snapshot.bodies[placement.body] * layout_.link_in_body(link, snapshot.wheel_angles);
}

void Distances::Impl::place(const Snapshot& snapshot) {
  const auto all = [&](std::vector<Piece>& pieces, std::vector<Box>& boxes, size_t first) {
    Pose X_WL;
    for (size_t i = first; i < pieces.size(); ++i) {
      if (i == first || pieces[i].link != pieces[i - 1].link)
        X_WL = pose_of(pieces[i].link, snapshot);
      boxes[i] = pieces[i].place(X_WL);
    }
  };
  all(own_, own_boxes_, 0);
  all(others_, boxes_, fixed_);
  if (!robot_.valid()) return;
  const Pose& X_WBase = snapshot.robots[robot_].X_WBase;
  ground_ = {true, to_bt(X_WBase.translation), to_bt(Vec3(X_WBase.rotation * Vec3::UnitZ()))};
}

void Distances::Impl::find_candidates(double reach) {
  candidates_.clear();
  Box around;
  for (const Box& box : own_boxes_) around.include(box);
  for (size_t other = 0; other < others_.size(); ++other) {
    if (around.gap(boxes_[other]) > reach) continue;
    for (size_t own = 0; own < own_.size(); ++own) {
      const double at_least = own_boxes_[own].gap(boxes_[other]);
      if (at_least <= reach) candidates_.push_back({at_least, own, other});
    }
  }
  std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
    return std::tie(a.at_least, a.own, a.other) < std::tie(b.at_least, b.own, b.other);
  });
}

Distances::Nearest Distances::Impl::nearest(const Snapshot& snapshot, double reach) {
  nearest_ = {};
  best_m_ = reach;
  place(snapshot);
  if (touched(snapshot)) return nearest_;
  find_candidates(reach);
  for (const Candidate& candidate : candidates_) {
    if (candidate.at_least > best_m_ || nearest_.distance == 0.0) break;
    measure(own_[candidate.own], others_[candidate.other]);
  }
  return nearest_;
}

bool Distances::Impl::touched(const Snapshot& snapshot) {
  for (const Contact& contact : snapshot.contacts) {
    if (!layout_.links.has(contact.link_a) || !layout_.links.has(contact.link_b)) continue;
    const bool a = layout_.links[contact.link_a].instance == of_,
               b = layout_.links[contact.link_b].instance == of_;
    ClosestPoints gap;
    gap.on_b = to_bt(contact.position);
    gap.normal = to_bt(a ? contact.normal : Vec3(-contact.normal));
    if (a == b || ground_.carries(gap, false)) continue;
    nearest_ = {0.0, a ? contact.link_a : contact.link_b, a ? contact.link_b : contact.link_a,
                contact.position, contact.position};
    return true;
  }
  return false;
}

// Of pairs that touch, the direction is that after the own shape was raised.
bool Distances::Impl::counts(const PlacedShape& own, const PlacedShape& other,
                             const ClosestPoints& gap, const Ground& ground, bool faces_up) const {
  if (!ground.any) return true;
  if (gap.distance > kTouches_m) return !ground.carries(gap, faces_up);
  const btTransform raised(own.X.getBasis(), own.X.getOrigin() + ground.up * kLow_m);
  return !ground.carries(closest_points({own.shape, raised}, other, 2.0 * kLow_m), faces_up);
}

void Distances::Impl::keep(const Piece& own, const Piece& other, const ClosestPoints& gap) {
  best_m_ = gap.distance;
  nearest_ = {gap.distance, own.link, other.link, from_bt(gap.on_a), from_bt(gap.on_b)};
}

// Measures the triangles of a mesh, in its frame M.
class Distances::Impl::Triangles final : public btTriangleCallback {
 public:
  Triangles(Impl& impl, const Piece& own, const Piece& mesh)
      : impl_(impl),
        own_(own),
        mesh_(mesh),
        X_MS_(mesh.X_WS.inverseTimes(own.X_WS)),
        ground_(impl.ground_.seen_from(mesh.X_WS)),
        box_(box_of(*own.shape, X_MS_)) {}

  void measure() {
    const Vec3 reach = Vec3::Constant(impl_.best_m_);
    static_cast<const btConcaveShape&>(*mesh_.shape)
        .processAllTriangles(this, to_bt(Vec3(box_.low - reach)), to_bt(Vec3(box_.high + reach)));
  }

  void processTriangle(btVector3* corners, int, int) override {
    Box box;
    for (int i = 0; i < 3; ++i) box.include({from_bt(corners[i]), from_bt(corners[i])});
    if (box.gap(box_) > impl_.best_m_) return;
    const btVector3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    const bool faces_up = std::abs(normal.dot(ground_.up)) > kUpwards * normal.length();
    if (faces_up && is_floor(corners)) return;
    btTriangleShape triangle(corners[0], corners[1], corners[2]);
    triangle.setMargin(0.0);
    const PlacedShape own{own_.convex(), X_MS_}, other{triangle, btTransform::getIdentity()};
    ClosestPoints gap = closest_points(own, other, impl_.best_m_);
    if (gap.distance > impl_.best_m_ || !impl_.counts(own, other, gap, ground_, faces_up)) return;
    gap.on_a = mesh_.X_WS * gap.on_a;
    gap.on_b = mesh_.X_WS * gap.on_b;
    impl_.keep(own_, mesh_, gap);
  }

 private:
  // Wherever it is nearest, it would not count.
  bool is_floor(const btVector3* corners) const {
    return ground_.any && std::all_of(corners, corners + 3, [&](const btVector3& corner) {
             return std::abs(ground_.height(corner)) < kLow_m;
           });
  }

  Impl& impl_;
  const Piece &own_, &mesh_;
  const btTransform X_MS_;
  const Ground ground_;
  const Box box_;
};

void Distances::Impl::measure(const Piece& own, const Piece& other) {
  if (other.shape->getShapeType() == STATIC_PLANE_PROXYTYPE) return measure_plane(own, other);
  if (has_triangles(*other.shape)) return Triangles(*this, own, other).measure();
  const PlacedShape a{own.convex(), own.X_WS}, b{other.convex(), other.X_WS};
  const ClosestPoints gap = closest_points(a, b, best_m_);
  if (gap.distance > best_m_) return;
  if (counts(a, b, gap, ground_, on_upper_face(b, gap.on_b, ground_.up))) keep(own, other, gap);
}

// A plane has a half-space inside.
void Distances::Impl::measure_plane(const Piece& own, const Piece& other) {
  const auto& plane = static_cast<const btStaticPlaneShape&>(*other.shape);
  ClosestPoints gap;
  gap.normal = other.X_WS.getBasis() * plane.getPlaneNormal();
  gap.on_a = own.X_WS * own.convex().localGetSupportingVertexWithoutMargin(-gap.normal *
                                                                           own.X_WS.getBasis()) -
             gap.normal * own.convex().getMargin();
  const double height = gap.normal.dot(gap.on_a - other.X_WS.getOrigin());
  gap.distance = std::max(height, 0.0);
  gap.on_b = gap.on_a - gap.normal * height;
  if (gap.distance <= best_m_ && !ground_.carries(gap, false)) keep(own, other, gap);
}

Distances::Distances(const world::WorldModel& world, const world::BodyLayout& layout,
                     InstanceIndex of)
    : impl_(std::make_unique<Impl>(world, layout, of)) {}
Distances::~Distances() = default;

Distances::Nearest Distances::nearest(const Snapshot& snapshot, double reach) {
  return impl_->nearest(snapshot, reach);
}

}  // namespace ruedo::physics
