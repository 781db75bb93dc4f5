// A tree over boxes, of movers or of static shapes: our own binary tree in double precision,
// because refitting it takes a twentieth of the time that Embree needs (which rebuilds user
// geometry, whatever quality is requested).
//
// Results do not depend on the tree's shape: every box that meets the beam is visited.
#pragma once

#include <vector>

#include "scene/rays/ray_mesh.h"

namespace ruedo::scene {

class BoxTree {
 public:
  // Boxes are numbered from 0; no ray meets an empty box.
  void build(std::vector<Box> boxes);
  Box& box(size_t i) { return boxes_[i]; }
  const Box& box(size_t i) const { return boxes_[i]; }
  void refit();  // after boxes have changed

  // The box around the segments of these lanes (bits) up to t inside the box of all boxes; the
  // lanes without such a segment are taken from `lanes`.
  Box beam(unsigned& lanes, const FrameRays& rays, const double* t) const;

  // Calls visit(i) for the boxes that meet `beam`.
  template <class Visit>
  void visit(const Box& beam, Visit visit) const;

  // The lanes (bits) that meet the box before t[lane].
  unsigned meeting(size_t i, unsigned lanes, const FrameRays& rays, const double* t) const;

 private:
  // In depth-first order: the first child of node i is i + 1.
  struct Node {
    Box box;
    int second = -1;  // index of the second child; -1: a leaf
    int leaf = -1;    // of a leaf: its box
  };
  void build_nodes();
  void split(int* first, int* last);
  double fit();

  std::vector<Box> boxes_;
  std::vector<Node> nodes_;
  std::vector<int> order_;  // while building
  double built_area_ = 0.0;
};

inline Box BoxTree::beam(unsigned& lanes, const FrameRays& rays, const double* t) const {
  Box beam;
  unsigned within = 0;
  for (unsigned rest = nodes_.empty() ? 0 : lanes; rest != 0; rest &= rest - 1) {
    const Box& root = nodes_[0].box;
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
  lanes = within;
  if (within) beam.grow(nodes_[0].box.rounding());
  return beam;
}

template <class Visit>
void BoxTree::visit(const Box& beam, Visit visit) const {
  if (nodes_.empty()) return;
  int stack[64];  // median splits make the tree as deep as the binary logarithm of its leaves
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const int index = stack[--depth];
    const Node& node = nodes_[index];
    if (!node.box.overlaps(beam)) continue;
    if (node.second < 0) {
      visit(static_cast<size_t>(node.leaf));
      continue;
    }
    stack[depth++] = node.second;
    stack[depth++] = index + 1;
  }
}

inline unsigned BoxTree::meeting(size_t i, unsigned lanes, const FrameRays& rays,
                                 const double* t) const {
  Box box = boxes_[i];
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
