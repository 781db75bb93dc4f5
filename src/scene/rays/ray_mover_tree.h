// The tree over the movers' boxes: our own binary tree in double precision, because refitting it
// takes a twentieth of the time that Embree needs (which rebuilds user geometry, whatever quality
// is requested).
//
// Results do not depend on the tree's shape: every mover whose box a ray meets is visited.
#pragma once

#include <vector>

#include "scene/rays/ray_mesh.h"

namespace ruedo::scene {

class MoverTree {
 public:
  // One box per mover, numbered from 0; no ray meets an empty box.
  void build(std::vector<Box> boxes);
  Box& box(size_t mover) { return boxes_[mover]; }
  void refit();  // after boxes have changed

  // Calls visit(mover, lanes, beam) for movers whose boxes meet `beam`, the box around the segments
  // of these lanes (bits) up to t inside the box of all movers. Whether a lane meets the mover's
  // own box is tested by meeting().
  template <class Visit>
  void visit(unsigned lanes, const FrameRays& rays, const double* t, Visit visit) const;

  // The lanes (bits) that meet the mover's box before t[lane].
  unsigned meeting(size_t mover, unsigned lanes, const FrameRays& rays, const double* t) const;

 private:
  // In depth-first order: the first child of node i is i + 1.
  struct Node {
    Box box;
    int second = -1;  // index of the second child; -1: a leaf
    int mover = -1;   // of a leaf
  };
  void build_nodes();
  void split(int* first, int* last);
  double fit();

  std::vector<Box> boxes_;
  std::vector<Node> nodes_;
  std::vector<int> order_;  // while building
  double built_area_ = 0.0;
};

template <class Visit>
void MoverTree::visit(unsigned lanes, const FrameRays& rays, const double* t, Visit visit) const {
  if (nodes_.empty()) return;
  // Rays of one packet that run close together.
  const Box& root = nodes_[0].box;
  Box beam;
  unsigned within = 0;
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    const Vec3 &o = rays.o[lane], &d = rays.d[lane];
    double enter = 0.0, exit = t[lane];
    Vec3 begin = o, end = o + exit * d;
    if (!root.contains(begin) || !root.contains(end)) {
      if (!root.clip(o, d, enter, exit)) continue;
      begin = o + enter * d;
      end = o + exit * d;
    }
    beam.add(begin);
    beam.add(end);
    within |= 1u << lane;
  }
  if (within == 0) return;
  beam.grow(root.rounding());
  int stack[64];  // median splits make the tree as deep as the binary logarithm of its leaves
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const int index = stack[--depth];
    const Node& node = nodes_[index];
    if (!node.box.overlaps(beam)) continue;
    if (node.second < 0) {
      visit(static_cast<size_t>(node.mover), within, beam);
      continue;
    }
    stack[depth++] = node.second;
    stack[depth++] = index + 1;
  }
}

inline unsigned MoverTree::meeting(size_t mover, unsigned lanes, const FrameRays& rays,
                                   const double* t) const {
  Box box = boxes_[mover];
  box.grow(box.rounding());
  unsigned meeting = 0;
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    double enter = 0.0, exit = t[lane];
    if (box.clip(rays.o[lane], rays.d[lane], enter, exit)) meeting |= 1u << lane;
  }
  return meeting;
}

}  // namespace ruedo::scene
