#include "scene/pictures/render_scene.h"

#include <algorithm>
#include <cmath>

#include "base/whole.h"
#include "ruedo/math.h"
#include "scene/pictures/render_device.h"
#include "scene/pictures/render_lights.h"

namespace ruedo::scene {
namespace {

using Matrix4 = Eigen::Matrix4d;

std::array<float, 16> to_floats(const Matrix4& m) {
  std::array<float, 16> out;
  Eigen::Map<Eigen::Matrix4f>(out.data()) = m.cast<float>();
  return out;
}

// The camera's axes right, down and forward as rows: world directions to the optical frame.
Eigen::Matrix3d optical_from_world(const View& view) {
  const Eigen::Matrix3d R = view.X_WCamera.rotation.toRotationMatrix();
  Eigen::Matrix3d rows;
  rows << -R.col(1).transpose(), -R.col(2).transpose(), R.col(0).transpose();
  return rows;
}

// Depth is near / Z in perspective (slightly less, so that the far plane is at 0), and linear in a
// parallel view: floats keep their precision at both ends.
struct DepthCurve {
  double a, b;  // perspective: d = a + b / Z; parallel: d = a + b Z
  explicit DepthCurve(const View& v) {
    const double n = v.near_m, f = v.far_m;
    a = v.orthographic ? f / (f - n) : -n / (f - n);
    b = v.orthographic ? -1.0 / (f - n) : n * f / (f - n);
  }
};

Matrix4 clip_from_world(const View& v) {
  const DepthCurve depth(v);
  // OpenGL counts pixels from their corners, half a pixel more. Rows run downwards in both, as
  // pictures are drawn upside down.
  const double sx = 2.0 * v.fx / v.width, sy = 2.0 * v.fy / v.height;
  const double ox = 2.0 * (v.cx + 0.5) / v.width - 1.0, oy = 2.0 * (v.cy + 0.5) / v.height - 1.0;
  Matrix4 P = Matrix4::Zero();
  if (v.orthographic) {
    P << sx, 0, 0, ox, 0, sy, 0, oy, 0, 0, depth.b, depth.a, 0, 0, 0, 1;
  } else {
    P << sx, 0, ox, 0, 0, sy, oy, 0, 0, 0, depth.a, depth.b, 0, 0, 1, 0;
  }
  Matrix4 R = Matrix4::Identity();
  R.topLeftCorner<3, 3>() = optical_from_world(v);
  return P * R;
}

class GlRenderer : public Renderer {
 public:
  GlRenderer(const world::WorldModel& world, const world::BodyLayout& layout)
      : content_(world, layout),
        culler_(layout, content_),
        lights_(world, content_),
        device_(make_gl_context(), content_, lights_.counts()) {
    description_ = device_.description();
    device_.context().release();
  }

  void draw(const Snapshot& snapshot, const View& view, Picture& picture,
            const Overlay& overlay) override {
    device_.context().make_current();
    culler_.update(snapshot);
    const Vec3 eye = view.X_WCamera.translation;
    culler_.collect(view_region(view), eye, std::max(view.fx, view.fy), view.orthographic,
                    visible_);
    FrameBlock frame{};
    fill(view, frame);
    lights_.fill(culler_, view, frame);

    const size_t pixels = static_cast<size_t>(view.width) * static_cast<size_t>(view.height);
    const int samples = std::max(view.samples, 1);
    const bool depth_from_colour = picture.want_rgb && samples == 1 && !picture.want_labels &&
                                   !content_.has_round;  // those are exact in the other pass only
    if (picture.want_depth) picture.depth.resize(pixels);
    if (picture.want_rgb) {
      picture.rgb.resize(3 * pixels);
      draw_shadows();
      device_.set_frame(frame);
      device_.begin_colour(view.width, view.height, samples);
      device_.draw(Pass::colour, visible_.instances, visible_.opaque);
      draw_sky(view);
      if (!visible_.transparent.empty())
        device_.draw(Pass::colour, visible_.instances, {}, visible_.transparent);
      draw_overlay(view, overlay);
      device_.read_rgb(picture.rgb.data());
      if (picture.want_depth && depth_from_colour) device_.read_depth(picture.depth.data());
    }
    if (picture.want_labels || (picture.want_depth && !depth_from_colour)) {
      device_.set_frame(frame);
      device_.begin_geometry(view.width, view.height);
      device_.draw(Pass::geometry, visible_.instances, visible_.opaque);
      if (picture.want_depth) device_.read_depth(picture.depth.data());
      if (picture.want_labels) {
        picture.labels.resize(pixels);
        device_.read_labels(picture.labels.data());
      }
    }
    if (picture.want_depth) {
      to_metres(view, picture.depth);
      mark_too_near(view, picture.depth);
    }
    device_.context().release();
  }

  std::string description() const override { return description_; }

 private:
  static void fill(const View& view, FrameBlock& frame) {
    frame.clip_from_world = to_floats(clip_from_world(view));
    const Vec3 ahead = view.X_WCamera.rotation * Vec3::UnitX();
    const Vec3 to_eye = view.orthographic ? Vec3(-ahead) : Vec3::Zero();
    frame.eye = {static_cast<float>(to_eye.x()), static_cast<float>(to_eye.y()),
                 static_cast<float>(to_eye.z()), view.orthographic ? 0.0f : 1.0f};
    // The ground's pattern repeats every two metres.
    const Vec3& p = view.X_WCamera.translation;
    frame.origin = {static_cast<float>(p.x() - 2.0 * std::floor(0.5 * p.x())),
                    static_cast<float>(p.y() - 2.0 * std::floor(0.5 * p.y())),
                    static_cast<float>(view.exposure), 0.0f};
  }

  // The static map is drawn once for each position of the region, the movers once for all pictures
  // of a step. Both are computed relative to the region's centre, not the eye: earlier pictures
  // must leave no trace.
  void draw_shadows() {
    if (!lights_.counts().shadow) return;
    const ShadowRegion& shadow = lights_.shadow();
    constexpr int kSize = ShadowRegion::kSize;
    FrameBlock frame{};
    frame.shadow_from_world = to_floats(shadow.map_from_world(shadow.centre));
    device_.set_frame(frame);
    const bool elsewhere = !shadow_drawn_ || !shadow.same_place(shadow_place_);
    if (elsewhere) {
      culler_.collect_casters(shadow.region, shadow.centre, Movers::only_static, casters_);
      device_.begin_still_shadow(kSize);
      device_.draw(Pass::shadow, casters_.instances, casters_.opaque);
      shadow_place_ = shadow;
      shadow_drawn_ = true;
      stale_ = {0, 0, kSize, kSize};
    }
    culler_.collect_casters(shadow.seen, shadow.centre, Movers::only_moving, casters_);
    if (!elsewhere && same_drawing(casters_, movers_)) return;
    std::swap(casters_, movers_);
    device_.begin_shadow(kSize, stale_);
    stale_ = {};
    if (movers_.opaque.empty()) return;
    device_.draw(Pass::shadow, movers_.instances, movers_.opaque);
    Eigen::AlignedBox2d box;
    for (const auto& [centre, radius] : movers_.spheres) {
      const Eigen::Vector2d at(shadow.right.dot(centre - shadow.centre),
                               shadow.up.dot(centre - shadow.centre));
      box.extend(at.array().matrix() - Eigen::Vector2d::Constant(radius));
      box.extend(at.array().matrix() + Eigen::Vector2d::Constant(radius));
    }
    const auto texel = [&](double metres, double rounding) {
      const double t = (metres / shadow.half + 1.0) * 0.5 * kSize;
      return whole<int>(std::clamp(std::floor(t) + rounding, 0.0, static_cast<double>(kSize)));
    };
    stale_ = {texel(box.min().x(), -1.0), texel(box.min().y(), -1.0), texel(box.max().x(), 2.0),
              texel(box.max().y(), 2.0)};
  }

  void draw_sky(const View& view) {
    // One triangle over the whole picture.
    std::array<float, 21> corners;
    const Eigen::Matrix3d world_from_optical = optical_from_world(view).transpose();
    for (size_t i = 0; i < 3; ++i) {
      const double x = i == 1 ? 3.0 : -1.0, y = i == 2 ? 3.0 : -1.0;
      Vec3 direction = Vec3::UnitZ();
      if (!view.orthographic) {
        direction = Vec3(((x + 1.0) * 0.5 * view.width - 0.5 - view.cx) / view.fx,
                         ((y + 1.0) * 0.5 * view.height - 0.5 - view.cy) / view.fy, 1.0);
      }
      direction = world_from_optical * direction;
      const double values[7] = {x, y, 0.0, 1.0, direction.x(), direction.y(), direction.z()};
      for (size_t k = 0; k < 7; ++k) corners[7 * i + k] = static_cast<float>(values[k]);
    }
    device_.draw_sky(corners);
  }

  void draw_overlay(const View& view, const Overlay& overlay) {
    overlay_.clear();
    add_lines(view, overlay.lines);
    add_facets(view, overlay.facets);
    if (!overlay_.empty()) device_.draw_overlay(overlay_);
  }

  void add_corner(Eigen::Vector4d corner, const std::array<float, 4>& rgba) {
    corner.z() += 1e-4 * std::abs(corner.z());  // in front of the surface that it lies on
    for (int i = 0; i < 4; ++i) overlay_.push_back(static_cast<float>(corner[i]));
    overlay_.insert(overlay_.end(), rgba.begin(), rgba.end());
  }

  void add_facets(const View& view, std::span<const Facet> facets) {
    const Matrix4 M = clip_from_world(view);
    for (const Facet& facet : facets) {
      for (const Vec3& corner : facet.corners)
        add_corner(M * (corner - view.X_WCamera.translation).homogeneous(), facet.rgba);
    }
  }

  // Lines as ribbons facing the viewer, so that their width in pixels is the same with every
  // driver.
  void add_lines(const View& view, std::span<const Line> lines) {
    const Matrix4 M = clip_from_world(view);
    for (const Line& line : lines) {
      Eigen::Vector4d a, b;
      a << line.from - view.X_WCamera.translation, 1.0;
      b << line.to - view.X_WCamera.translation, 1.0;
      a = M * a;
      b = M * b;
      if (!view.orthographic) {  // clipped at the near plane
        if (a.w() < view.near_m && b.w() < view.near_m) continue;
        if (a.w() < view.near_m) a += (b - a) * ((view.near_m - a.w()) / (b.w() - a.w()));
        if (b.w() < view.near_m) b += (a - b) * ((view.near_m - b.w()) / (a.w() - b.w()));
      }
      Eigen::Vector2d along(((b.x() / b.w()) - (a.x() / a.w())) * view.width,
                            ((b.y() / b.w()) - (a.y() / a.w())) * view.height);
      if (along.norm() < 1e-9) continue;
      along.normalize();
      const Eigen::Vector4d side(-along.y() * kLinePixels / view.width,
                                 along.x() * kLinePixels / view.height, 0, 0);
      const Eigen::Vector4d corners[6] = {a - a.w() * side, a + a.w() * side, b + b.w() * side,
                                          a - a.w() * side, b + b.w() * side, b - b.w() * side};
      for (const Eigen::Vector4d& corner : corners) add_corner(corner, line.rgba);
    }
  }

  static void to_metres(const View& view, std::vector<float>& depth) {
    const DepthCurve curve(view);
    const auto a = static_cast<float>(curve.a), b = static_cast<float>(curve.b);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    if (view.orthographic) {
      for (float& d : depth) d = d <= 0.0f ? kInfinity : (d - a) / b;
    } else {
      for (float& d : depth) d = d <= 0.0f ? kInfinity : b / (d - a);
    }
  }

  // Things before the near plane hide those behind them, as in Gazebo's depth cameras: -inf
  // (REP 117).
  void mark_too_near(const View& view, std::vector<float>& depth) {
    if (view.orthographic) return;
    View close = view;
    close.near_m = 1e-3 * view.near_m;
    close.far_m = (1.0 + 1e-6) * view.near_m;  // no gap between the two
    culler_.collect(view_region(close), view.X_WCamera.translation, std::max(view.fx, view.fy),
                    false, close_);
    if (close_.opaque.empty()) return;
    FrameBlock frame{};
    fill(close, frame);
    device_.set_frame(frame);
    device_.begin_geometry(view.width, view.height);
    device_.draw(Pass::geometry, close_.instances, close_.opaque);
    close_depth_.resize(depth.size());
    device_.read_depth(close_depth_.data());
    for (size_t i = 0; i < depth.size(); ++i) {
      if (close_depth_[i] > 0.0f) depth[i] = -std::numeric_limits<float>::infinity();
    }
  }

  static constexpr double kLinePixels = 2.5;

  RenderContent content_;
  Culler culler_;
  RenderLights lights_;
  RenderDevice device_;
  std::string description_;
  DrawList visible_, casters_, close_;
  DrawList movers_;                 // in the shadow map in use
  std::vector<float> close_depth_;  // as stored by OpenGL
  std::vector<float> overlay_;
  ShadowRegion shadow_place_;  // region of the kept shadow map
  bool shadow_drawn_ = false;
  PixelBox stale_;  // where the shadow map in use contains movers
};

}  // namespace

View View::pinhole(const Pose& X_WCamera, int width, int height, double hfov_rad) {
  View view;
  view.X_WCamera = X_WCamera;
  view.width = width;
  view.height = height;
  view.fx = view.fy = width / (2.0 * math::tan(0.5 * hfov_rad));
  view.cx = 0.5 * width;
  view.cy = 0.5 * height;
  return view;
}

std::unique_ptr<Renderer> make_renderer(const world::WorldModel& world,
                                        const world::BodyLayout& layout) {
  return std::make_unique<GlRenderer>(world, layout);
}

}  // namespace ruedo::scene
