#include "scene/rays/ray_fan.h"

#include <algorithm>

#include "base/math/wide.h"

namespace ruedo::scene {

namespace {

// How far each box reaches to the left of the right edge, and to the right of the left one,
// whichever is less. y_right is the side of the boxes that is farthest to the left of an edge with
// that direction, and so on.
RUEDO_WIDE void reaches_into(size_t count, double right_x, double right_y, const double* x_right,
                             const double* y_right, double left_x, double left_y,
                             const double* x_left, const double* y_left, double* reaches) {
  for (size_t i = 0; i < count; ++i) {
    const double left_of_right = right_x * y_right[i] - right_y * x_right[i];
    const double right_of_left = left_y * x_left[i] - left_x * y_left[i];
    reaches[i] = left_of_right < right_of_left ? left_of_right : right_of_left;
  }
}

}  // namespace

bool RayFan::collect(const BoxTree& tree, const Vec3& origin, const Box& reach) {
  count_ = 0;
  bool fits = true;
  const double rounding = 1e-12 * origin.cwiseAbs().maxCoeff();
  tree.visit(reach, [&](size_t i) {
    if (count_ == kMost) {
      fits = false;
      return;
    }
    Box box = tree.box(i);
    box.grow(box.rounding() + rounding);
    const Vec3 lower = box.lower - origin, upper = box.upper - origin;
    box_[count_] = i;
    x0_[count_] = lower.x();
    x1_[count_] = upper.x();
    y0_[count_] = lower.y();
    y1_[count_] = upper.y();
    // Directions are unit vectors, to 0.1 % of their squares (see usable()).
    distance_[count_] = 0.999 * lower.cwiseMax(-upper).cwiseMax(0.0).norm();
    ++count_;
  });
  return fits;
}

RayFan::Wedge RayFan::wedge(unsigned lanes, const FrameRays& rays) {
  const Vec3& first = rays.d[std::countr_zero(lanes)];
  Wedge wedge{first.x(), first.y(), first.x(), first.y()};
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const Vec3& d = rays.d[std::countr_zero(rest)];
    if (!(first.x() * d.x() + first.y() * d.y() > 0.0)) return {};  // up to half a turn wide
    if (wedge.left_x * d.y() - wedge.left_y * d.x() > 0.0) {
      wedge.left_x = d.x();
      wedge.left_y = d.y();
    }
    if (wedge.right_x * d.y() - wedge.right_y * d.x() < 0.0) {
      wedge.right_x = d.x();
      wedge.right_y = d.y();
    }
  }
  return wedge;
}

size_t RayFan::select(const Wedge& wedge, Near* selected) const {
  double reaches[kMost];
  reaches_into(count_, wedge.right_x, wedge.right_y, wedge.right_y > 0.0 ? x0_ : x1_,
               wedge.right_x > 0.0 ? y1_ : y0_, wedge.left_x, wedge.left_y,
               wedge.left_y > 0.0 ? x1_ : x0_, wedge.left_x > 0.0 ? y0_ : y1_, reaches);
  size_t count = 0;
  for (size_t i = 0; i < count_; ++i) {
    if (reaches[i] < 0.0) continue;
    size_t at = count++;
    for (; at > 0 && selected[at - 1].distance > distance_[i]; --at)
      selected[at] = selected[at - 1];
    selected[at] = {distance_[i], box_[i]};
  }
  return count;
}

}  // namespace ruedo::scene
