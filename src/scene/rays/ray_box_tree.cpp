#include "scene/rays/ray_box_tree.h"

#include <numeric>

namespace ruedo::scene {

void BoxTree::build(std::vector<Box> boxes) {
  boxes_ = std::move(boxes);
  order_.resize(boxes_.size());
  nodes_.reserve(2 * boxes_.size());
  build_nodes();
}

void BoxTree::build_nodes() {
  nodes_.clear();
  if (boxes_.empty()) return;
  std::iota(order_.begin(), order_.end(), 0);
  split(order_.data(), order_.data() + order_.size());
  built_area_ = fit();
}

// Splits the boxes in half by their centres along the longest side.
void BoxTree::split(int* first, int* last) {
  const size_t index = nodes_.size();
  nodes_.emplace_back();
  if (last - first == 1) {
    nodes_[index].leaf = *first;
    return;
  }
  const auto center = [&](int i) -> Vec3 {
    const Box& box = boxes_[i];
    return box.empty() ? Vec3::Zero() : Vec3(0.5 * box.lower + 0.5 * box.upper);
  };
  Box centers;
  for (const int* each = first; each != last; ++each) centers.add(center(*each));
  int axis = 0;
  (centers.upper - centers.lower).maxCoeff(&axis);
  int* middle = first + (last - first) / 2;
  std::nth_element(first, middle, last, [&](int a, int b) {
    const double at_a = center(a)[axis], at_b = center(b)[axis];
    return at_a != at_b ? at_a < at_b : a < b;
  });
  split(first, middle);
  nodes_[index].second = static_cast<int>(nodes_.size());
  split(middle, last);
}

// Bottom-up; returns the sum of the inner boxes' surfaces.
double BoxTree::fit() {
  double area = 0.0;
  for (size_t i = nodes_.size(); i-- > 0;) {
    Node& node = nodes_[i];
    if (node.second < 0) {
      node.box = boxes_[node.leaf];
      if (!node.box.empty()) node.box.grow(node.box.rounding());
      continue;
    }
    node.box = nodes_[i + 1].box;
    node.box.add(nodes_[node.second].box);
    if (node.box.empty()) continue;
    const Vec3 side = node.box.upper - node.box.lower;
    area += side.x() * side.y() + side.y() * side.z() + side.z() * side.x();
  }
  return area;
}

void BoxTree::refit() {
  // A tree is rebuilt when its boxes have grown too much.
  if (fit() > 2.0 * built_area_) build_nodes();
}

}  // namespace ruedo::scene
