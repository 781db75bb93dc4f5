// Pictures of the world without a display: OpenGL 3.3 core on OSMesa, or on surfaceless EGL.
//
// A Renderer owns one context. It may move between threads, but serves one at a time: several
// cameras use several cores with a pool of renderers. Pixels depend on nothing but the world, the
// snapshot and the view; they are the same from every renderer, in every run (see
// mesas_environment.h), with both backends.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "ruedo/snapshot.h"
#include "world/model/body_layout.h"

namespace ruedo::scene {

// A pinhole camera. X_WCamera follows SDF's camera convention: x forward, y left, z up. A point a
// metres ahead, r to the right and d below appears at column cx + fx r / a and row cy + fy d / a;
// integers are pixel centres, as in OpenCV.
struct View {
  Pose X_WCamera;
  int width = 640, height = 480;          // pixels
  double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels
  double near_m = 0.1, far_m = 100.0;
  bool orthographic = false;  // then fx and fy are pixels per metre
  int samples = 1;            // 4: antialiased colour; depth and labels are never mixed
  double exposure = 1.0;      // factor applied to light

  // Square pixels and the principal point at (width / 2, height / 2). hfov in rad.
  static View pinhole(const Pose& X_WCamera, int width, int height, double hfov_rad);
};

// The requested buffers of a picture, with rows from the top. Depth and labels see through
// transparent things.
struct Picture {
  bool want_rgb = true, want_depth = false, want_labels = false;
  std::vector<uint8_t> rgb;  // width * height * 3
  std::vector<float> depth;  // m along the optical axis, +inf: nothing
  // index in ruedo/info's bodies + 1: moving bodies, then static links; 0: nothing
  std::vector<uint16_t> labels;
};

// Coloured lines over the picture, a few pixels wide: rays and cones in ruedo render.
struct Line {
  Vec3 from, to;
  std::array<float, 4> rgba;
};
// An unlit, two-sided triangle in the world.
struct Facet {
  std::array<Vec3, 3> corners;
  std::array<float, 4> rgba;
};
struct Overlay {
  std::span<const Line> lines = {};
  std::span<const Facet> facets = {};
};

// An axis-aligned box in the world, m.
struct Bounds {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
};

class Renderer {
 public:
  virtual ~Renderer() = default;
  // Draws the world in the state of `snapshot`; the picture's vectors keep their capacity.
  virtual void draw(const Snapshot& snapshot, const View& view, Picture& picture,
                    const Overlay& overlay = {}) = 0;
  virtual std::string description() const = 0;  // for ruedo doctor: backend, renderer, version
};

// world and layout must outlive the renderer. Throws EnvironmentError with the remedy if
// there is no backend.
std::unique_ptr<Renderer> make_renderer(const world::WorldModel& world,
                                        const world::BodyLayout& layout);

}  // namespace ruedo::scene
