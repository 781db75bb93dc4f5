// The fast caster: trees find candidate boxes, the tests in double precision decide. A mover has
// one box per body, so that updating a thousand robots means updating a thousand boxes.
#include "scene/rays/ray_scene.h"

#include "scene/rays/ray_mover_tree.h"
#include "scene/rays/ray_static.h"

namespace ruedo::scene {

namespace {

class EmbreeRayScene : public RayScene {
 public:
  explicit EmbreeRayScene(std::shared_ptr<const StaticRayScene> statics);

  void update(const Snapshot& snapshot) override;
  void cast(std::span<const Ray> rays, std::span<Hit> hits, LinkIndex ignored_link) const override;

 private:
  struct Mover {
    BodyIndex body;
    Vec3 center_B, half_B;  // box around its shapes
    IntoShape into;         // world to body
    bool there = false;     // false: its pose is not finite
  };

  static void into_body(const Mover& mover, unsigned lanes, const FrameRays& world,
                        FrameRays& body);
  void test_near(int index, unsigned lanes, const FrameRays& body, RayBatch& batch) const;
  void test_unbounded(const Mover& mover, unsigned lanes, RayBatch& batch) const;
  void test_bounded(size_t bounded, unsigned lanes, const Box& beam, RayBatch& batch) const;
  void cast_batch(unsigned lanes, TreeQuery& query) const;
  void write(const RayBatch& batch, int lane, Hit& hit) const;

  std::shared_ptr<const StaticRayScene> statics_;
  std::vector<Mover> bounded_, unbounded_;
  IndexedVector<BodyIndex, int> mover_of_body_;  // index into bounded_, or ~index into unbounded_
  // As RayTable::turning, at the snapshot's wheel angles.
  IndexedVector<TurningIndex, IntoShape> turning_;
  MoverTree tree_;
};

EmbreeRayScene::EmbreeRayScene(std::shared_ptr<const StaticRayScene> statics)
    : statics_(std::move(statics)) {
  const RayTable& table = statics_->table;
  std::vector<Box> boxes;
  mover_of_body_.resize(table.bodies.size());
  for (const BodyIndex body : table.bodies.indices()) {
    Box box;
    bool fits = true;
    for (const int index : table.bodies[body]) {
      const Box& of_shape = table.shapes[index].box_F;
      fits = fits && fits_tree(of_shape);
      box.add(of_shape);
    }
    if (table.bodies[body].empty()) continue;
    Mover mover;
    mover.body = body;
    mover.center_B = 0.5 * (box.lower + box.upper);
    mover.half_B = 0.5 * (box.upper - box.lower);
    mover_of_body_[body] =
        fits ? static_cast<int>(bounded_.size()) : ~static_cast<int>(unbounded_.size());
    (fits ? bounded_ : unbounded_).push_back(mover);
    if (fits) boxes.push_back(box);
  }
  for (const TurningShape& shape : table.turning) turning_.push_back(shape.at(0.0));
  tree_.build(std::move(boxes));
  Snapshot start;
  for (const world::BodyPlacement& body : statics_->layout.bodies)
    start.bodies.push_back(body.X_WB);
  start.wheel_angles.resize(statics_->layout.wheels.size());
  update(start);
}

void EmbreeRayScene::update(const Snapshot& snapshot) {
  const auto place = [&](Mover& mover) {
    const Pose& X_WB = snapshot.bodies[mover.body];
    mover.into = IntoShape(X_WB);
    mover.there = X_WB.translation.allFinite() && X_WB.rotation.coeffs().allFinite();
  };
  for (Mover& mover : unbounded_) place(mover);
  for (size_t i = 0; i < bounded_.size(); ++i) {
    Mover& mover = bounded_[i];
    place(mover);
    const Eigen::Matrix3d R_WB = mover.into.rotation.transpose();
    const Vec3 center = snapshot.bodies[mover.body].translation + R_WB * mover.center_B;
    const Vec3 half = R_WB.cwiseAbs() * mover.half_B;
    const Box box{center - half, center + half};
    tree_.box(i) = mover.there ? box : Box{};
  }
  for (const TurningIndex i : turning_.indices()) {
    const TurningShape& shape = statics_->table.turning[i];
    turning_[i] = shape.at(snapshot.wheel_angles[shape.wheel]);
  }
  tree_.refit();
}

void EmbreeRayScene::into_body(const Mover& mover, unsigned lanes, const FrameRays& world,
                               FrameRays& body) {
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    body.o[lane] = mover.into.point(world.o[lane]);
    body.d[lane] = mover.into.vector(world.d[lane]);
  }
}

void EmbreeRayScene::test_near(int index, unsigned lanes, const FrameRays& body,
                               RayBatch& batch) const {
  const RayShape& shape = statics_->table.shapes[index];
  unsigned near = lanes;
  if (shape.kind != world::Shape::plane) {
    near = 0;
    for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
      const int lane = std::countr_zero(rest);
      if (near_ball(shape, body.o[lane], body.d[lane])) near |= 1u << lane;
    }
  }
  const IntoShape& into = shape.turning.valid() ? turning_[shape.turning] : shape.into;
  if (near) test_shape(shape, index, into, near, body, batch);
}

void EmbreeRayScene::test_unbounded(const Mover& mover, unsigned lanes, RayBatch& batch) const {
  if (!mover.there) return;
  FrameRays body;
  into_body(mover, lanes, batch.world, body);
  for (const int index : statics_->table.bodies[mover.body]) test_near(index, lanes, body, batch);
}

// Most packets that come near a mover start on it and pass over its wheels: testing the beam's box
// in the body's frame rejects all lanes at once, before any ray is transformed.
void EmbreeRayScene::test_bounded(size_t bounded, unsigned lanes, const Box& beam,
                                  RayBatch& batch) const {
  const Mover& mover = bounded_[bounded];
  const Vec3 center = mover.into.point(0.5 * (beam.lower + beam.upper));
  const Vec3 half = mover.into.rotation.cwiseAbs() * (0.5 * (beam.upper - beam.lower));
  const Box beam_B{center - half, center + half};
  FrameRays body;
  bool turned = false;
  for (const int index : statics_->table.bodies[mover.body]) {
    const RayShape& shape = statics_->table.shapes[index];
    if (shape.link == batch.ignored_link || !shape.box_F.overlaps(beam_B)) continue;
    if (!turned) {
      turned = true;
      lanes = tree_.meeting(bounded, lanes, batch.world, batch.t);
      if (!lanes) return;
      into_body(mover, lanes, batch.world, body);
    }
    test_near(index, lanes, body, batch);
  }
}

void EmbreeRayScene::cast_batch(unsigned lanes, TreeQuery& query) const {
  statics_->cast(lanes, query);
  for (const Mover& mover : unbounded_) test_unbounded(mover, lanes, query.batch);
  tree_.visit(lanes, query.batch.world, query.batch.t,
              [&](size_t mover, unsigned within, const Box& beam) {
                test_bounded(mover, within, beam, query.batch);
              });
}

void EmbreeRayScene::cast(std::span<const Ray> rays, std::span<Hit> hits,
                          LinkIndex ignored_link) const {
  TreeQuery query;
  RayBatch& batch = query.batch;
  batch.ignored_link = ignored_link;
  for (size_t first = 0; first < rays.size(); first += kLanes) {
    const int n = static_cast<int>(std::min<size_t>(kLanes, rays.size() - first));
    unsigned lanes = 0;
    for (int lane = 0; lane < n; ++lane) {
      const Ray& ray = rays[first + static_cast<size_t>(lane)];
      batch.shape[lane] = RayBatch::kNothing;
      if (!usable(ray)) continue;
      batch.world.o[lane] = ray.origin;
      batch.world.d[lane] = ray.direction;
      if (statics_->has_meshes()) batch.world.shear[lane] = Shear(ray.direction);
      batch.t[lane] = ray.max_range;
      lanes |= 1u << lane;
    }
    if (lanes) cast_batch(lanes, query);
    for (int lane = 0; lane < n; ++lane)
      write(batch, lane, hits[first + static_cast<size_t>(lane)]);
  }
}

void EmbreeRayScene::write(const RayBatch& batch, int lane, Hit& hit) const {
  if (batch.shape[lane] == RayBatch::kNothing) {
    hit = {};
    return;
  }
  const RayShape& shape = statics_->table.shapes[batch.shape[lane]];
  hit.range = batch.t[lane];
  hit.link = shape.link;
  hit.shape = shape.shape;
  Vec3 o = batch.world.o[lane], d = batch.world.d[lane];
  if (batch.feature[lane] == kInside) {
    hit.normal = -d;
    return;
  }
  if (shape.kind == world::Shape::mesh && !shape.body.valid()) {  // in the world's frame
    const Vec3 normal = shape_normal(shape, batch.feature[lane], Vec3::Zero());
    hit.normal = normal.dot(d) <= 0.0 ? normal : Vec3(-normal);
    return;
  }
  const IntoShape* body = nullptr;
  if (shape.body.valid()) {
    const int mover = mover_of_body_[shape.body];
    body = mover >= 0 ? &bounded_[mover].into : &unbounded_[~mover].into;
    o = body->point(o);
    d = body->vector(d);
  }
  const IntoShape& into = shape.turning.valid() ? turning_[shape.turning] : shape.into;
  o = into.point(o);
  d = into.vector(d);
  Vec3 normal = into.vector_back(shape_normal(shape, batch.feature[lane], o + hit.range * d));
  if (body) normal = body->vector_back(normal);
  hit.normal = normal.dot(batch.world.d[lane]) <= 0.0 ? normal : Vec3(-normal);
}

}  // namespace

std::unique_ptr<RayScene> make_ray_scene(std::shared_ptr<const StaticRayScene> statics) {
  if (statics->backend == Backend::reference) return make_reference_ray_scene(std::move(statics));
  return std::make_unique<EmbreeRayScene>(std::move(statics));
}

}  // namespace ruedo::scene
