#include "scene/rays/ray_table.h"

#include "ruedo/math.h"

namespace ruedo::scene {

using world::Shape;

namespace {

// Corners of the box around the shape, in its own frame.
Vec3 half_box(const RayShape& shape) {
  const Vec3& s = shape.size;
  switch (shape.kind) {
    case Shape::box:
    case Shape::ellipsoid: return s;
    case Shape::sphere: return Vec3::Constant(s.x());
    case Shape::cylinder:
    case Shape::cone: return {s.x(), s.x(), s.y()};
    case Shape::capsule: return {s.x(), s.x(), s.x() + s.y()};
    case Shape::plane:
    case Shape::mesh: break;
  }
  return Vec3::Zero();
}

// The shortest rotation that takes z to that unit vector.
Quat turned_to(const Vec3& n) {
  if (n.z() < -1.0 + 1e-12) return Quat(0, 1, 0, 0);
  return Quat(1.0 + n.z(), -n.y(), n.x(), 0.0).normalized();
}

// Whether the shape is unchanged by rotation about the axis through that point of the link.
bool round_about(const RayShape& shape, const Pose& X_LS, const Vec3& center_in_L,
                 const Vec3& axis_in_L) {
  const auto along_axis = [&](const Vec3& v) { return v.cross(axis_in_L).norm() <= 1e-9; };
  if (!along_axis(X_LS.translation - center_in_L)) return false;
  switch (shape.kind) {
    case Shape::sphere: return true;
    case Shape::cylinder:
    case Shape::capsule:
    case Shape::cone: return along_axis(X_LS.rotation * Vec3::UnitZ());
    default: return false;
  }
}

// As RayShape::size defines it; 0 for a plane or mesh.
Vec3 size_of(const world::Geometry& geometry) {
  const Vec3& s = geometry.size;
  switch (geometry.shape) {
    case Shape::box: return 0.5 * s;
    case Shape::sphere: return {s.x(), 0, 0};
    case Shape::cylinder:
    case Shape::capsule:
    case Shape::cone: return {s.x(), 0.5 * s.y(), 0};
    case Shape::ellipsoid: return s;
    case Shape::plane:
    case Shape::mesh: break;
  }
  return Vec3::Zero();
}

// Computes the box and bounding sphere of the shape in its current place.
void enclose(RayShape& shape, const Pose& X_FS) {
  if (shape.grid) {
    const Box& box = shape.grid->box();
    for (int i = 0; i < 8; ++i)
      shape.box_F.add(X_FS * Vec3((i & 1 ? box.lower : box.upper).x(),
                                  (i & 2 ? box.lower : box.upper).y(),
                                  (i & 4 ? box.lower : box.upper).z()));
  } else if (shape.kind == Shape::mesh) {
    for (const Vec3& p : shape.mesh->positions()) shape.box_F.add(X_FS * p);
  } else if (shape.kind != Shape::plane) {
    const Vec3 half = shape.into.rotation.transpose().cwiseAbs() * half_box(shape);
    shape.box_F.add(X_FS.translation - half);
    shape.box_F.add(X_FS.translation + half);
  }
  if (shape.box_F.empty()) return;
  shape.center_F = 0.5 * (shape.box_F.lower + shape.box_F.upper);
  shape.radius = 0.5 * (shape.box_F.upper - shape.box_F.lower).norm();
}

}  // namespace

RayTable::RayTable(const world::WorldModel& world, const world::BodyLayout& layout, bool visuals,
                   RTCDevice device)
    : bodies(layout.bodies.size()) {
  for (size_t i = 0; i < layout.links.size(); ++i) {
    const world::LinkPlacement& placement = layout.links[i];
    const world::ModelInstance& instance = world.models[placement.instance];
    if (instance.removed) continue;
    const world::Link& link = instance.model->links[placement.link];
    const LinkIndex link_index(i);
    if (visuals) {
      for (size_t v = 0; v < link.visuals.size(); ++v)
        if (link.visuals[v].transparency < 1.0)
          add(placement, link_index, ShapeIndex(v), link.visuals[v].X_LV, link.visuals[v].geometry,
              layout, true, device);
    } else {
      for (size_t c = 0; c < link.collisions.size(); ++c)
        add(placement, link_index, ShapeIndex(c), link.collisions[c].X_LC,
            link.collisions[c].geometry, layout, false, device);
    }
  }
}

std::shared_ptr<const RayMesh> RayTable::mesh_of(const world::Geometry& geometry, const Pose* X_FS,
                                                 RTCDevice device) {
  if (X_FS) return std::make_shared<RayMesh>(*geometry.mesh, geometry.scale, *X_FS);
  const Vec3& scale = geometry.scale;
  auto& shared = meshes_[{geometry.mesh.get(), scale.x(), scale.y(), scale.z()}];
  if (!shared) {
    const auto mesh = std::make_shared<RayMesh>(*geometry.mesh, scale, Pose());
    if (device) mesh->build_tree(device);
    shared = mesh;
  }
  return shared;
}

void RayTable::add_turning(RayShape& shape, const Pose& X_LS, const world::LinkPlacement& link,
                           const world::BodyLayout& layout) {
  // Parts fixed to the wheel's own link rotate about the same axis, expressed in their frame.
  const Pose& X_FL = link.X_BL;
  const world::WheelPlacement& wheel = layout.wheels[link.wheel];
  const Pose X_LWheel = X_FL.inverse() * layout.links[wheel.link].X_BL;
  const Vec3 axis_in_L = (X_LWheel.rotation * wheel.axis_in_L).normalized(),
             center_in_L = X_LWheel * wheel.center_in_L;
  if (round_about(shape, X_LS, center_in_L, axis_in_L)) return;
  shape.turning = turning.next();
  turning.push_back({link.wheel, X_FL, X_LS, axis_in_L, center_in_L});
  // The sphere around all it sweeps, centred at the point of the axis nearest to its centre.
  const Vec3 axis_in_F = X_FL.rotation * axis_in_L;
  const Vec3 center_in_F = X_FL * center_in_L;
  const Vec3 on_axis = center_in_F + axis_in_F * axis_in_F.dot(shape.center_F - center_in_F);
  shape.radius += (shape.center_F - on_axis).norm();
  shape.center_F = on_axis;
  shape.box_F.add(on_axis - Vec3::Constant(shape.radius));
  shape.box_F.add(on_axis + Vec3::Constant(shape.radius));
}

void RayTable::add(const world::LinkPlacement& link, LinkIndex link_index, ShapeIndex shape_index,
                   const Pose& X_LShape, const world::Geometry& geometry,
                   const world::BodyLayout& layout, bool visuals, RTCDevice device) {
  const bool is_mesh = geometry.shape == Shape::mesh;
  if (is_mesh && (!geometry.mesh || world::triangle_count(*geometry.mesh) == 0)) return;
  RayShape shape;
  Pose X_LS = X_LShape;
  shape.kind = geometry.shape;
  shape.link = link_index;
  shape.shape = shape_index;
  shape.body = link.body;
  shape.size = size_of(geometry);
  if (geometry.shape == Shape::plane) {
    shape.normal = geometry.normal.normalized();
    if (visuals) {  // a drawn plane is a rectangle: a box without height
      shape.kind = Shape::box;
      shape.size = Vec3(0.5 * geometry.extent.x(), 0.5 * geometry.extent.y(), 0.0);
      X_LS = X_LS * Pose{turned_to(shape.normal), Vec3::Zero()};
    }
  }
  Pose X_FS = (link.X_BL * X_LS).normalized();
  if (is_mesh) {
    const bool is_static = !link.body.valid();
    if (const world::HeightMap* heights = world::height_map(*geometry.mesh))
      shape.grid = std::make_shared<const RayGrid>(heights->grid, is_static ? X_FS : Pose());
    else
      shape.mesh = mesh_of(geometry, is_static ? &X_FS : nullptr, device);
    if (is_static) X_FS = Pose();  // given in the world's frame already
  }
  shape.into = IntoShape(X_FS);
  enclose(shape, X_FS);
  if (link.wheel.valid() && shape.kind != Shape::plane) add_turning(shape, X_LS, link, layout);
  shape.radius *= 1.0 + 1e-9;  // against rounding in the test
  const int index = static_cast<int>(shapes.size());
  (shape.body.valid() ? bodies[shape.body] : statics).push_back(index);
  shapes.push_back(std::move(shape));
}

bool RayBatch::inside_mesh(const RayShape& shape, int index, const Vec3& p_F, const Vec3& p_S) {
  if (!shape.mesh->closed() || !shape.mesh->box().contains(p_S)) return false;
  for (const Asked& asked : asked_)
    if (asked.index == index && asked.p_F == p_F) return asked.inside;
  asked_[oldest_] = {index, p_F, shape.mesh->inside(p_S)};
  const bool inside = asked_[oldest_].inside;
  oldest_ = (oldest_ + 1) % 4;
  return inside;
}

namespace {

template <class Test>
inline void each_lane(int index, const IntoShape& into, unsigned lanes, const FrameRays& rays,
                      RayBatch& batch, Test test) {
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    batch.offer(lane, test(into.point(rays.o[lane]), into.vector(rays.d[lane])), index);
  }
}

void test_mesh(const RayShape& shape, int index, const IntoShape& into, unsigned lanes,
               const FrameRays& rays, RayBatch& batch) {
  FrameRays local;
  unsigned outside = 0;
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    local.o[lane] = into.point(rays.o[lane]);
    local.d[lane] = into.vector(rays.d[lane]);
    if (shape.mesh && batch.inside_mesh(shape, index, rays.o[lane], local.o[lane]))
      batch.offer(lane, {0.0, kInside}, index);
    else
      outside |= 1u << lane;
    local.shear[lane] = Shear(local.d[lane]);
  }
  ShapeHit hits[kLanes];
  if (shape.grid)
    shape.grid->intersect(outside, local, batch.t, hits);
  else
    shape.mesh->intersect(outside, local, batch.t, hits);
  for (unsigned rest = outside; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    batch.offer(lane, hits[lane], index);
  }
}

}  // namespace

void test_shape(const RayShape& shape, int index, const IntoShape& into, unsigned lanes,
                const FrameRays& rays, RayBatch& batch) {
  if (shape.link == batch.ignored_link) return;
  const Vec3& s = shape.size;
  const auto each = [&](auto test) { each_lane(index, into, lanes, rays, batch, test); };
  switch (shape.kind) {
    case Shape::box:
      return each([&](const Vec3& o, const Vec3& d) { return intersect_box(o, d, s); });
    case Shape::sphere:
      return each([&](const Vec3& o, const Vec3& d) { return intersect_sphere(o, d, s.x()); });
    case Shape::cylinder:
      return each(
          [&](const Vec3& o, const Vec3& d) { return intersect_cylinder(o, d, s.x(), s.y()); });
    case Shape::capsule:
      return each(
          [&](const Vec3& o, const Vec3& d) { return intersect_capsule(o, d, s.x(), s.y()); });
    case Shape::ellipsoid:
      return each([&](const Vec3& o, const Vec3& d) { return intersect_ellipsoid(o, d, s); });
    case Shape::cone:
      return each([&](const Vec3& o, const Vec3& d) { return intersect_cone(o, d, s.x(), s.y()); });
    case Shape::plane:
      return each(
          [&](const Vec3& o, const Vec3& d) { return intersect_plane(o, d, shape.normal); });
    case Shape::mesh: return test_mesh(shape, index, into, lanes, rays, batch);
  }
}

Vec3 shape_normal(const RayShape& shape, int feature, const Vec3& p) {
  // From memory: a vector written component by component and read at once stalls the processor.
  static const Vec3 kFaces[6] = {{-1.0, -0.0, -0.0}, {1.0, 0.0, 0.0},    {-0.0, -1.0, -0.0},
                                 {0.0, 1.0, 0.0},    {-0.0, -0.0, -1.0}, {0.0, 0.0, 1.0}};
  const Vec3& s = shape.size;
  const auto end = [&](int f) { return Vec3(0.0, 0.0, f == kTop ? 1.0 : -1.0); };
  switch (shape.kind) {
    case Shape::box: return kFaces[feature];
    case Shape::sphere: return p.normalized();
    case Shape::ellipsoid: return p.cwiseQuotient(s).cwiseQuotient(s).normalized();
    case Shape::cylinder:
      return feature == kSide ? Vec3(p.x(), p.y(), 0.0).normalized() : end(feature);
    case Shape::capsule:
      return feature == kSide ? Vec3(p.x(), p.y(), 0.0).normalized()
                              : (p - s.y() * end(feature)).normalized();
    case Shape::cone: {
      if (feature != kSide) return end(feature);
      const double around = math::hypot(p.x(), p.y());
      if (around == 0.0) return Vec3::UnitZ();  // the apex
      return Vec3(p.x() / around * 2.0 * s.y(), p.y() / around * 2.0 * s.y(), s.x()).normalized();
    }
    case Shape::plane: return shape.normal;
    case Shape::mesh: return shape.grid ? shape.grid->normal(feature) : shape.mesh->normal(feature);
  }
  return Vec3::UnitZ();
}

}  // namespace ruedo::scene
