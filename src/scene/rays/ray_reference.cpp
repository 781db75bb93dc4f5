// The slow reference caster for tests: every ray against every shape, without trees, packets,
// bounds or single precision.
#include "scene/rays/ray_static.h"

namespace ruedo::scene {

namespace {

class ReferenceRayScene : public RayScene {
 public:
  explicit ReferenceRayScene(std::shared_ptr<const StaticRayScene> statics)
      : statics_(std::move(statics)) {
    for (const world::BodyPlacement& body : statics_->layout.bodies)
      bodies_.emplace_back(body.X_WB);
    for (const TurningShape& shape : statics_->table.turning) turning_.push_back(shape.at(0.0));
  }

  void update(const Snapshot& snapshot) override {
    for (size_t i = 0; i < bodies_.size(); ++i) bodies_[i] = IntoShape(snapshot.bodies[i]);
    for (const TurningIndex i : turning_.indices()) {
      const TurningShape& shape = statics_->table.turning[i];
      turning_[i] = shape.at(snapshot.wheel_angles[shape.wheel]);
    }
  }

  void cast(std::span<const Ray> rays, std::span<Hit> hits, LinkIndex ignored_link) const override {
    for (size_t i = 0; i < rays.size(); ++i) hits[i] = cast_one(rays[i], ignored_link);
  }

 private:
  IntoShape into_frame(const RayShape& shape) const {
    return shape.body.valid() ? bodies_[shape.body] : IntoShape();
  }
  const IntoShape& into_shape(const RayShape& shape) const {
    return shape.turning.valid() ? turning_[shape.turning] : shape.into;
  }

  Hit cast_one(const Ray& ray, LinkIndex ignored_link) const {
    if (!usable(ray)) return {};
    const std::vector<RayShape>& shapes = statics_->table.shapes;
    RayBatch batch;
    batch.ignored_link = ignored_link;
    batch.t[0] = ray.max_range;
    batch.shape[0] = RayBatch::kNothing;
    for (size_t i = 0; i < shapes.size(); ++i) {
      const IntoShape frame = into_frame(shapes[i]);
      FrameRays rays;
      rays.o[0] = shapes[i].body.valid() ? frame.point(ray.origin) : ray.origin;
      rays.d[0] = shapes[i].body.valid() ? frame.vector(ray.direction) : ray.direction;
      test_shape(shapes[i], static_cast<int>(i), into_shape(shapes[i]), 1u, rays, batch);
    }
    if (batch.shape[0] == RayBatch::kNothing) return {};

    const RayShape& shape = shapes[batch.shape[0]];
    Hit hit{batch.t[0], shape.link, shape.shape, -ray.direction};
    if (batch.feature[0] == kInside) return hit;
    const IntoShape frame = into_frame(shape), &into = into_shape(shape);
    const bool moves = shape.body.valid();
    const Vec3 o = into.point(moves ? frame.point(ray.origin) : ray.origin);
    const Vec3 d = into.vector(moves ? frame.vector(ray.direction) : ray.direction);
    hit.normal = into.vector_back(shape_normal(shape, batch.feature[0], o + hit.range * d));
    if (moves) hit.normal = frame.vector_back(hit.normal);
    if (hit.normal.dot(ray.direction) > 0.0) hit.normal = -hit.normal;
    return hit;
  }

  std::shared_ptr<const StaticRayScene> statics_;
  std::vector<IntoShape> bodies_;
  IndexedVector<TurningIndex, IntoShape> turning_;
};

}  // namespace

std::unique_ptr<RayScene> make_reference_ray_scene(std::shared_ptr<const StaticRayScene> statics) {
  return std::make_unique<ReferenceRayScene>(std::move(statics));
}

}  // namespace ruedo::scene
