// Polygons are clipped as by I. Sutherland and G. Hodgman, "Reentrant polygon clipping", 1974.
#include "physics/collision/faces.h"

#include <algorithm>
#include <utility>

#include <BulletCollision/CollisionShapes/btTriangleShape.h>

#include "physics/collision/convex_shapes.h"

namespace ruedo::physics {

namespace {

// Component of a unit vector along an axis beyond which it points to the end, not to the side.
constexpr btScalar kEnd = 0.7;
constexpr btScalar kParallel = 0.05;  // sine of the angle of two edges that lie along each other
constexpr btScalar kSteep = 0.3;  // cosine of the angle from a face beyond which it is seen from
                                  // its edge

// The direction across z, or x.
btVector3 across_z(const btVector3& d) {
  const btVector3 flat(d.x(), d.y(), 0.0);
  return flat.length2() > 1e-12 ? flat.normalized() : btVector3(1, 0, 0);
}

// Eight points of a circle about z, one of them farthest towards d.
Face circle(btScalar radius, btScalar z, const btVector3& d) {
  const btVector3 high = across_z(d), aside(-high.y(), high.x(), 0.0);
  constexpr btScalar k = SIMDSQRT12;
  Face face;
  for (const btVector3& p : {high, k * (high + aside), aside, k * (aside - high), -high,
                             -k * (high + aside), -aside, k * (high - aside)})
    face.add(radius * p + btVector3(0, 0, z));
  return face;
}

Face edge(const btVector3& from, const btVector3& to) {
  Face face;
  face.add(from);
  face.add(to);
  return face;
}

Face of_box(const btBoxShape& box, const btVector3& d) {
  const btVector3 half = box.getHalfExtentsWithMargin();
  const int axis = d.absolute().maxAxis(), first = (axis + 1) % 3, second = (axis + 2) % 3;
  Face face;
  for (const auto& [u, v] : {std::pair(1, 1), {-1, 1}, {-1, -1}, {1, -1}}) {
    btVector3 corner;
    corner[axis] = d[axis] < 0.0 ? -half[axis] : half[axis];
    corner[first] = u * half[first];
    corner[second] = v * half[second];
    face.add(corner);
  }
  return face;
}

Face of_cylinder(const btCylinderShape& cylinder, const btVector3& d) {
  const btScalar radius = cylinder.getRadius(), half = cylinder.getHalfExtentsWithMargin().z();
  if (btFabs(d.z()) > kEnd) return circle(radius, d.z() < 0.0 ? -half : half, d);
  const btVector3 side = radius * across_z(d);
  return edge(side - btVector3(0, 0, half), side + btVector3(0, 0, half));
}

Face of_capsule(const btCapsuleShape& capsule, const btVector3& d) {
  if (btFabs(d.z()) > kEnd) return {};
  const btVector3 side = capsule.getRadius() * d, end(0, 0, capsule.getHalfHeight());
  return edge(side - end, side + end);
}

Face of_cone(const btConeShape& cone, const btVector3& d) {
  const btScalar radius = cone.getRadius(), height = cone.getHeight();
  const btVector3 out = across_z(d);
  const btVector3 side = (out * height + btVector3(0, 0, radius)).normalized();
  if (-d.z() > side.dot(d)) return circle(radius, -height / 2, d);
  if (side.dot(d) < kEnd) return {};
  return edge(radius * out - btVector3(0, 0, height / 2), btVector3(0, 0, height / 2));
}

Face of_tyre(const TyreShape& tyre, const btVector3& d) {
  if (btFabs(d.z()) <= kEnd) return {};
  Face face = circle(tyre.core(), 0.0, d);
  for (btVector3& corner : face.corners) corner += tyre.getMargin() * d;
  return face;
}

Face of_hull(const HullShape& hull, const btVector3& d) {
  const HullShape::Side* best = nullptr;
  btScalar most = 0.0;
  for (const HullShape::Side& side : hull.sides()) {
    const btScalar along = side.normal.dot(d);
    if (along > most) best = &side, most = along;
  }
  Face face;
  if (!best) return face;
  const size_t n = best->corners.size(), of_each = (n + Face::kMost - 1) / Face::kMost;
  for (size_t i = 0; i < n; i += of_each) face.add(best->corners[i]);
  return face;
}

Face of_triangle(const btTriangleShape& triangle) {
  Face face;
  for (const btVector3& corner : triangle.m_vertices1) face.add(corner);
  return face;
}

Face local_face(const btCollisionShape& shape, const btVector3& d) {
  switch (shape.getShapeType()) {
    case BOX_SHAPE_PROXYTYPE: return of_box(static_cast<const btBoxShape&>(shape), d);
    case CYLINDER_SHAPE_PROXYTYPE:
      return of_cylinder(static_cast<const btCylinderShape&>(shape), d);
    case CAPSULE_SHAPE_PROXYTYPE: return of_capsule(static_cast<const btCapsuleShape&>(shape), d);
    case CONE_SHAPE_PROXYTYPE: return of_cone(static_cast<const btConeShape&>(shape), d);
    case CONVEX_HULL_SHAPE_PROXYTYPE: return of_hull(static_cast<const HullShape&>(shape), d);
    case TRIANGLE_SHAPE_PROXYTYPE: return of_triangle(static_cast<const btTriangleShape&>(shape));
    default: break;
  }
  const auto* tyre = dynamic_cast<const TyreShape*>(&shape);
  return tyre ? of_tyre(*tyre, d) : Face{};
}

// The part of the face on that side of a plane.
void cut(Face& face, const btVector3& at, const btVector3& inward) {
  const Face whole = face;
  face.count = 0;
  const size_t sides = whole.count > 2 ? whole.count : whole.count - 1;
  const auto height = [&](size_t i) { return inward.dot(whole.corners[i] - at); };
  for (size_t i = 0; i < whole.count; ++i) {
    const btScalar here = height(i);
    if (here >= 0.0) face.add(whole.corners[i]);
    if (i >= sides) break;
    const size_t next = (i + 1) % whole.count;
    const btScalar there = height(next);
    if ((here < 0.0) != (there < 0.0)) {
      const btScalar part = here / (here - there);
      face.add(whole.corners[i] + part * (whole.corners[next] - whole.corners[i]));
    }
  }
}

// The part of `face` that is above or below `of`, seen along the normal.
void cut_to(Face& face, const Face& of, const btVector3& normal) {
  if (of.count == 2) {
    btVector3 along = of.corners[1] - of.corners[0];
    along -= along.dot(normal) * normal;
    cut(face, of.corners[0], along);
    if (face.count > 0) cut(face, of.corners[1], -along);
    return;
  }
  const btScalar sense = of.normal().dot(normal) < 0.0 ? -1.0 : 1.0;
  for (size_t i = 0; i < of.count && face.count > 0; ++i) {
    const btVector3 side = of.corners[(i + 1) % of.count] - of.corners[i];
    cut(face, of.corners[i], sense * normal.cross(side));
  }
}

// The reference's plane; of an edge, the one through it that is most nearly across `normal`.
btVector3 plane_of(const Face& reference, const btVector3& normal) {
  if (reference.count > 2) return reference.normal();
  const btVector3 along = reference.corners[1] - reference.corners[0];
  return along.cross(normal).cross(along);
}

bool lie_along(const Face& a, const Face& b, const btVector3& normal) {
  const btVector3 of_a = (a.corners[1] - a.corners[0]).cross(normal),
                  of_b = (b.corners[1] - b.corners[0]).cross(normal);
  const btScalar lengths = of_a.length() * of_b.length();
  return lengths > 0.0 && of_a.cross(of_b).length() < kParallel * lengths;
}

}  // namespace

btVector3 Face::normal() const {
  btVector3 sum(0, 0, 0);
  for (size_t i = 2; i < count; ++i)
    sum += (corners[i - 1] - corners[0]).cross(corners[i] - corners[0]);
  return sum;
}

Face face_towards(const btCollisionShape& shape, const btTransform& X, const btVector3& direction) {
  Face face = local_face(shape, direction * X.getBasis());
  for (size_t i = 0; i < face.count; ++i) face.corners[i] = X * face.corners[i];
  return face;
}

btVector3 farthest_point(const btConvexShape& shape, const btTransform& X,
                         const btVector3& direction) {
  const btVector3 d = direction * X.getBasis();
  if (shape.getShapeType() != CYLINDER_SHAPE_PROXYTYPE)
    return X * shape.localGetSupportingVertex(d);
  const auto& cylinder = static_cast<const btCylinderShape&>(shape);
  btVector3 point = cylinder.getRadius() * across_z(d);
  const btScalar half = cylinder.getHalfExtentsWithMargin().z();
  point.setZ(d.z() < 0.0 ? -half : half);
  return X * point;
}

btVector3 center_before(const btCollisionObjectWrapper& placed, btScalar substep_s) {
  const btCollisionShape& shape = *placed.getCollisionShape();
  const btTransform& X = placed.getWorldTransform();
  if (shape.getShapeType() == TRIANGLE_SHAPE_PROXYTYPE)
    return X * static_cast<const btTriangleShape&>(shape).m_vertices1[0];
  const auto* body = btRigidBody::upcast(placed.getCollisionObject());
  return body ? X.getOrigin() - substep_s * body->getLinearVelocity() : X.getOrigin();
}

void for_each_side(const btCollisionShape& shape, const btTransform& X, const btVector3& towards,
                   const std::function<void(const btVector3&)>& act) {
  const btMatrix3x3& R = X.getBasis();
  const int type = shape.getShapeType();
  if (type == CONVEX_HULL_SHAPE_PROXYTYPE) {
    for (const HullShape::Side& side : static_cast<const HullShape&>(shape).sides())
      act(R * side.normal);
  } else if (type == TRIANGLE_SHAPE_PROXYTYPE) {
    const btVector3 normal = R * of_triangle(static_cast<const btTriangleShape&>(shape)).normal();
    const btScalar length = normal.length();
    if (!(length > 0.0)) return;
    act(normal / length);
    act(-normal / length);
  } else if (type == BOX_SHAPE_PROXYTYPE) {
    for (int axis = 0; axis < 3; ++axis) {
      act(R.getColumn(axis));
      act(-R.getColumn(axis));
    }
  } else {
    act(R.getColumn(2));
    act(-R.getColumn(2));
    act(R * across_z(towards * R));
  }
}

void overlap(const Face& a, const Face& b, const btVector3& normal,
             std::vector<TouchingPoint>& into) {
  if (a.count < 2 || b.count < 2) return;
  if (a.count == 2 && b.count == 2 && !lie_along(a, b, normal)) return;
  const auto facing = [&](const Face& face) {
    const btVector3 plane = face.normal();
    const btScalar length = plane.length();
    return length > 0.0 ? btFabs(plane.dot(normal)) / length : 0.0;
  };
  const bool on_b = facing(b) >= facing(a) - 1e-9;
  const Face& reference = on_b ? b : a;
  Face cut_face = on_b ? a : b;
  cut_to(cut_face, reference, normal);
  const btVector3 plane = plane_of(reference, normal);
  const btScalar slope = plane.dot(normal);
  if (btFabs(slope) <= kSteep * plane.length()) return;
  for (size_t i = 0; i < cut_face.count; ++i) {
    const btVector3& p = cut_face.corners[i];
    const btScalar height = plane.dot(p - reference.corners[0]) / slope;  // along the normal
    into.push_back(on_b ? TouchingPoint{p - height * normal, height} : TouchingPoint{p, -height});
  }
}

}  // namespace ruedo::physics
