// A camera's optics: reads SDF's <camera> into a pinhole, and computes the maps that distort an
// ideal picture like the lens.
//
// Distortion is the model of Brown and Conrady that SDF and OpenCV use (OpenCV, "Camera Calibration
// and 3D Reconstruction"): the ideal point (x, y) at depth 1 is seen at x' = x (1 + k1 r^2 + k2 r^4
// + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), y' = y (...) + p1 (r^2 + 2 y^2) + 2 p2 x y.
#pragma once

#include <array>
#include <memory>

#include <opencv2/core/mat.hpp>

#include "ruedo/element.h"
#include "scene/pictures/render_scene.h"

namespace ruedo {

namespace world {
struct WorldModel;
}

struct Lens {
  int width = 320, height = 240;          // pixels
  double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels; integers are pixel centres
  double near_m = 0.1, far_m = 100.0;
  double hfov = 1.047;                 // rad
  std::array<double, 5> distortion{};  // k1, k2, p1, p2, k3: OpenCV's order

  // Reads <horizontal_fov>, <image>, <clip>, <distortion> and <lens><intrinsics>. Throws
  // InputError.
  explicit Lens(const Element& camera);

  bool distorts() const { return distortion != std::array<double, 5>{}; }
  // Where the lens shows the ideal point (x, y) at depth 1, in the same units.
  Eigen::Vector2d distort(const Eigen::Vector2d& p) const;
  // The inverse, by Newton's method; false where the lens folds the picture and shows nothing.
  bool undistort(const Eigen::Vector2d& distorted, Eigen::Vector2d& p) const;
};

// Draws a larger ideal picture and resamples it to the lens's picture. Immutable.
class LensMap {
 public:
  // For a lens with distortion: the cameras of a fleet, and of the copies of a world, share their
  // lens's. Throws InputError, which names the <distortion>, if all of the world have too many
  // pixels with this one.
  static std::shared_ptr<const LensMap> of(const Lens& lens, const Element& camera,
                                           const world::WorldModel& world);

  explicit LensMap(const Lens& lens);

  const scene::View& ideal() const { return ideal_; }  // what to draw; the caller sets its pose
  // Interpolates colour and grey; takes the nearest pixel for depth and labels. Outside the lens's
  // view, pixels are black, label 0 and `nothing`.
  void blend(const cv::Mat& from, cv::Mat& to) const;
  void pick(const cv::Mat& from, cv::Mat& to, double nothing) const;

 private:
  scene::View ideal_;
  cv::Mat fixed_, fraction_, nearest_;  // OpenCV's maps in fixed point
};

}  // namespace ruedo
