// The static shapes that rays from one origin may meet. Range finders and sonars cast such fans:
// the boxes within reach are collected once, and each packet of eight rays takes those that lie,
// seen from above, in the wedge between its outermost rays. This only selects; the exact test
// decides.
#pragma once

#include "scene/rays/ray_box_tree.h"
#include "scene/rays/ray_table.h"

namespace ruedo::scene {

class RayFan {
 public:
  // reach: around the rays up to their maximum range, from `origin`. False if so many boxes are
  // within reach that Embree's tree takes less time.
  bool collect(const BoxTree& tree, const Vec3& origin, const Box& reach);

  // Calls test(i) for the boxes that these lanes (bits) may meet before batch.t, the nearest first.
  template <class Test>
  void visit(unsigned lanes, const RayBatch& batch, Test test) const;

 private:
  static constexpr size_t kMost = 64;
  struct Near {
    double distance;
    size_t box;
  };
  // In the plane, from the origin: a box is beyond an edge if all of it is on the wrong side.
  struct Wedge {
    double right_x = 0.0, right_y = 0.0, left_x = 0.0, left_y = 0.0;  // all 0: everything is inside
  };
  static Wedge wedge(unsigned lanes, const FrameRays& rays);
  size_t select(const Wedge& wedge, Near* selected) const;

  size_t count_ = 0;
  size_t box_[kMost];
  double distance_[kMost];                                // no ray meets the box before
  double x0_[kMost], x1_[kMost], y0_[kMost], y1_[kMost];  // sides, from the origin
};

template <class Test>
void RayFan::visit(unsigned lanes, const RayBatch& batch, Test test) const {
  Near selected[kMost];
  const size_t count = select(wedge(lanes, batch.world), selected);
  for (size_t i = 0; i < count; ++i) {
    double farthest = 0.0;
    for (unsigned rest = lanes; rest != 0; rest &= rest - 1)
      farthest = std::max(farthest, batch.t[std::countr_zero(rest)]);
    if (selected[i].distance > farthest) return;
    test(selected[i].box);
  }
}

}  // namespace ruedo::scene
