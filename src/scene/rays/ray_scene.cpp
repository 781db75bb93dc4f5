// The fast caster: trees and fans find candidate boxes, the tests in double precision decide. A
// mover has one box per body, so that updating a thousand robots means updating a thousand boxes.
#include "scene/rays/ray_scene.h"

#include <array>

#include "scene/rays/ray_box_tree.h"
#include "scene/rays/ray_static.h"

namespace ruedo::scene {

namespace {

// The box around a box, in the frame into which `into` leads.
Box box_in(const IntoShape& into, const Box& box) {
  const Vec3 center = into.point(0.5 * (box.lower + box.upper));
  const Vec3 half = into.rotation.cwiseAbs() * (0.5 * (box.upper - box.lower));
  return {center - half, center + half};
}

// Loads the origins and directions of these lanes (bits).
void load(std::span<const Ray> rays, size_t packet, unsigned lanes, RayBatch& batch) {
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    const Ray& ray = rays[packet * kLanes + static_cast<size_t>(lane)];
    batch.world.o[lane] = ray.origin;
    batch.world.d[lane] = ray.direction;
  }
}

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
  // The rays of a cast, packet by packet: their hits so far.
  struct CastPacket {
    unsigned lanes;   // valid rays
    unsigned beamed;  // those that come near movers
    Box beam;
    double t[kLanes];
    int shape[kLanes], feature[kLanes];

    void keep(const RayBatch& batch) {
      std::copy_n(batch.t, kLanes, t);
      std::copy_n(batch.shape, kLanes, shape);
      std::copy_n(batch.feature, kLanes, feature);
    }
    void restore(RayBatch& batch) const {
      std::copy_n(t, kLanes, batch.t);
      std::copy_n(shape, kLanes, batch.shape);
      std::copy_n(feature, kLanes, batch.feature);
    }
  };
  static constexpr size_t kPackets = 32;      // that are cast together
  static constexpr size_t kFewestOfFan = 24;  // rays for which a fan takes less time than Embree

  void test_bounded(size_t bounded, unsigned lanes, const Box& beam, RayBatch& batch) const;
  bool meets(size_t bounded, const Box& beam, LinkIndex ignored_link) const;
  void prepare(std::span<const Ray> rays, std::span<CastPacket> packets,
               StaticRayScene::Within& within) const;
  void cast_packets(std::span<const Ray> rays, std::span<CastPacket> packets,
                    TreeQuery& query) const;
  void cast_movers(std::span<const Ray> rays, std::span<CastPacket> packets, RayBatch& batch) const;
  void write(const Ray& ray, const CastPacket& packet, int lane, Hit& hit) const;

  std::shared_ptr<const StaticRayScene> statics_;
  std::vector<Mover> bounded_, unbounded_;
  IndexedVector<BodyIndex, int> mover_of_body_;  // index into bounded_, or ~index into unbounded_
  // As RayTable::turning, at the snapshot's wheel angles.
  IndexedVector<TurningIndex, IntoShape> turning_;
  BoxTree tree_;
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

// Whether the beam comes near one of the mover's shapes.
bool EmbreeRayScene::meets(size_t bounded, const Box& beam, LinkIndex ignored_link) const {
  const Mover& mover = bounded_[bounded];
  const Box beam_B = box_in(mover.into, beam);
  for (const int index : statics_->table.bodies[mover.body]) {
    const RayShape& shape = statics_->table.shapes[index];
    if (shape.link != ignored_link && shape.box_F.overlaps(beam_B)) return true;
  }
  return false;
}

// Most packets that come near a mover start on it and pass over its wheels: testing the beam's box
// in the body's frame rejects all lanes at once, before any ray is transformed.
void EmbreeRayScene::test_bounded(size_t bounded, unsigned lanes, const Box& beam,
                                  RayBatch& batch) const {
  const Mover& mover = bounded_[bounded];
  const Box beam_B = box_in(mover.into, beam);
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

// Finds the valid rays, and what rays from one origin may meet.
void EmbreeRayScene::prepare(std::span<const Ray> rays, std::span<CastPacket> packets,
                             StaticRayScene::Within& within) const {
  const Vec3& origin = rays[0].origin;
  Box reach;
  bool fan = rays.size() >= kFewestOfFan;
  for (size_t i = 0; i < rays.size(); ++i) {
    const Ray& ray = rays[i];
    CastPacket& packet = packets[i / kLanes];
    if (i % kLanes == 0) packet.lanes = 0;
    if (!usable(ray)) continue;
    packet.lanes |= 1u << (i % kLanes);
    fan = fan && ray.origin == origin && ray.max_range <= kFarthest;
    if (fan) reach.add(origin + ray.max_range * ray.direction);
  }
  if (!fan || reach.empty()) return;
  reach.add(origin);
  reach.grow(reach.rounding());
  statics_->prepare(origin, reach, within);
}

void EmbreeRayScene::cast_packets(std::span<const Ray> rays, std::span<CastPacket> packets,
                                  TreeQuery& query) const {
  RayBatch& batch = query.batch;
  StaticRayScene::Within within;
  prepare(rays, packets, within);
  for (size_t p = 0; p < packets.size(); ++p) {
    CastPacket& packet = packets[p];
    std::fill_n(batch.shape, kLanes, RayBatch::kNothing);
    load(rays, p, packet.lanes, batch);
    for (unsigned rest = packet.lanes; rest != 0; rest &= rest - 1) {
      const int lane = std::countr_zero(rest);
      batch.t[lane] = rays[p * kLanes + static_cast<size_t>(lane)].max_range;
      if (statics_->has_meshes()) batch.world.shear[lane] = Shear(batch.world.d[lane]);
    }
    if (packet.lanes) statics_->cast(packet.lanes, within, query);
    for (const Mover& mover : unbounded_) test_unbounded(mover, packet.lanes, batch);
    packet.beamed = packet.lanes;
    packet.beam = tree_.beam(packet.beamed, batch.world, batch.t);
    packet.keep(batch);
  }
  cast_movers(rays, packets, batch);
}

// One visit of the tree finds the movers near all packets, mostly none.
void EmbreeRayScene::cast_movers(std::span<const Ray> rays, std::span<CastPacket> packets,
                                 RayBatch& batch) const {
  constexpr size_t kFew = 16;  // for more, each packet asks the tree
  size_t near[kFew], count = 0;
  Box beam;
  for (const CastPacket& packet : packets)
    if (packet.beamed) beam.add(packet.beam);
  tree_.visit(beam, [&](size_t mover) {
    if (count > kFew || !meets(mover, beam, batch.ignored_link)) return;
    if (count < kFew) near[count] = mover;
    ++count;
  });
  if (count == 0) return;
  for (size_t p = 0; p < packets.size(); ++p) {
    CastPacket& packet = packets[p];
    if (!packet.beamed) continue;
    load(rays, p, packet.beamed, batch);
    packet.restore(batch);
    const auto test = [&](size_t mover) { test_bounded(mover, packet.beamed, packet.beam, batch); };
    if (count > kFew) {
      tree_.visit(packet.beam, test);
    } else {
      for (size_t i = 0; i < count; ++i)
        if (tree_.box(near[i]).overlaps(packet.beam)) test(near[i]);
    }
    packet.keep(batch);
  }
}

void EmbreeRayScene::cast(std::span<const Ray> rays, std::span<Hit> hits,
                          LinkIndex ignored_link) const {
  thread_local std::array<CastPacket, kPackets> packets;
  TreeQuery query;
  query.batch.ignored_link = ignored_link;
  for (size_t first = 0; first < rays.size(); first += kPackets * kLanes) {
    const auto some = rays.subspan(first, std::min(kPackets * kLanes, rays.size() - first));
    cast_packets(some, std::span(packets).first((some.size() + kLanes - 1) / kLanes), query);
    for (size_t i = 0; i < some.size(); ++i)
      write(some[i], packets[i / kLanes], static_cast<int>(i % kLanes), hits[first + i]);
  }
}

void EmbreeRayScene::write(const Ray& ray, const CastPacket& packet, int lane, Hit& hit) const {
  if (packet.shape[lane] == RayBatch::kNothing) {
    hit = {};
    return;
  }
  const RayShape& shape = statics_->table.shapes[packet.shape[lane]];
  hit.range = packet.t[lane];
  hit.link = shape.link;
  hit.shape = shape.shape;
  Vec3 o = ray.origin, d = ray.direction;
  if (packet.feature[lane] == kInside) {
    hit.normal = -d;
    return;
  }
  if (shape.kind == world::Shape::mesh && !shape.body.valid()) {  // in the world's frame
    const Vec3 normal = shape_normal(shape, packet.feature[lane], Vec3::Zero());
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
  Vec3 normal = into.vector_back(shape_normal(shape, packet.feature[lane], o + hit.range * d));
  if (body) normal = body->vector_back(normal);
  hit.normal = normal.dot(ray.direction) <= 0.0 ? normal : Vec3(-normal);
}

}  // namespace

std::unique_ptr<RayScene> make_ray_scene(std::shared_ptr<const StaticRayScene> statics) {
  if (statics->backend == Backend::reference) return make_reference_ray_scene(std::move(statics));
  return std::make_unique<EmbreeRayScene>(std::move(statics));
}

}  // namespace ruedo::scene
