#include "scene/pictures/render_lights.h"

#include <algorithm>
#include <cmath>

#include "ruedo/math.h"

namespace ruedo::scene {
namespace {

using Vec4 = FrameBlock::Vec4;

Vec4 vec4(const Vec3& v, double w) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()),
          static_cast<float>(w)};
}

// Converts a displayed colour to light: its square (see the shaders' curve).
Vec4 as_light(const world::Rgba& c, float factor) {
  return {factor * c[0] * c[0], factor * c[1] * c[1], factor * c[2] * c[2], 0.0f};
}

Vec4 light_colour(const world::Light& light) {
  const auto factor = static_cast<float>(light.intensity);
  return {factor * light.diffuse[0], factor * light.diffuse[1], factor * light.diffuse[2],
          light.type == world::Light::Type::spot ? 1.0f : 0.0f};
}

// Range of shadows around a camera among the things, m.
constexpr double kShadowReach = 20.0;
// Of the map, around what a view sees: lookups are offset and filtered.
constexpr double kMarginTexels = 8.0;

// Corners of what a view sees, m, world.
std::vector<Vec3> corners_of(const View& view) {
  const auto& [rotation, eye] = view.X_WCamera;
  const Vec3 ahead = rotation * Vec3::UnitX(), left = rotation * Vec3::UnitY(),
             up = rotation * Vec3::UnitZ();
  std::vector<Vec3> corners;
  for (const double distance : {view.orthographic ? view.near_m : 0.0, view.far_m}) {
    const double scale = view.orthographic ? 1.0 : distance;
    for (const double u : {-0.5, view.width - 0.5}) {
      for (const double v : {-0.5, view.height - 0.5})
        corners.push_back(eye + distance * ahead + scale * (view.cx - u) / view.fx * left +
                          scale * (view.cy - v) / view.fy * up);
    }
  }
  return corners;
}

// The convex hull of points, counterclockwise (A. M. Andrew's monotone chain, 1979).
std::vector<Eigen::Vector2d> hull_of(std::vector<Eigen::Vector2d> points) {
  const auto before = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y());
  };
  std::sort(points.begin(), points.end(), before);
  std::vector<Eigen::Vector2d> hull;
  for (int side = 0; side < 2; ++side) {
    const size_t begin = hull.size();
    for (const Eigen::Vector2d& point : points) {
      while (hull.size() >= begin + 2) {
        const Eigen::Vector2d a = hull.back() - hull[hull.size() - 2], b = point - hull.back();
        if (a.x() * b.y() - a.y() * b.x() > 0.0) break;
        hull.pop_back();
      }
      hull.push_back(point);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

}  // namespace

Eigen::Matrix4d ShadowRegion::map_from_world(const Vec3& origin) const {
  const Vec3 offset = origin - centre;
  Eigen::Matrix4d M = Eigen::Matrix4d::Identity();
  M.row(0) << right.transpose() / half, right.dot(offset) / half;
  M.row(1) << up.transpose() / half, up.dot(offset) / half;
  M.row(2) << -to_sun.transpose() / (2.0 * reach), 0.5 - to_sun.dot(offset) / (2.0 * reach);
  return M;
}

RenderLights::RenderLights(const world::WorldModel& world, const RenderContent& content)
    : world_(world), content_(content) {
  for (const RenderLight& light : content.lights) {
    auto& list = light.light.type == world::Light::Type::directional ? suns_ : lamps_;
    const size_t limit = &list == &suns_ ? kMaxDirectionalLights : kMaxLocalLights;
    if (list.size() < limit) list.push_back(&light);
  }
  // The first sun that casts shadows gets the shadow map.
  std::stable_partition(suns_.begin(), suns_.end(),
                        [](const RenderLight* l) { return l->light.cast_shadows; });
  counts_.suns = static_cast<int>(suns_.size());
  counts_.lamps = static_cast<int>(lamps_.size());
  counts_.shadow = world.sky.shadows && !suns_.empty() && suns_[0]->light.cast_shadows;
}

void RenderLights::fill(const Culler& culler, const View& view, FrameBlock& frame) {
  const Vec3 eye = view.X_WCamera.translation;
  const world::Sky& sky = world_.sky;
  // Light from the sky is stronger than light reflected by the ground.
  frame.ambient_up = as_light(sky.ambient, 1.9f);
  frame.ambient_down = as_light(sky.ambient, 0.9f);
  if (sky.sky) {
    frame.sky_top = as_light({0.36f, 0.56f, 0.83f, 1}, 1);
    frame.sky_horizon = as_light({0.80f, 0.86f, 0.91f, 1}, 1);
    frame.sky_ground = as_light({0.55f, 0.56f, 0.56f, 1}, 1);
  } else {
    frame.sky_top = frame.sky_horizon = frame.sky_ground = as_light(sky.background, 1);
  }
  const auto pose_of = [&](const RenderLight& light) {
    const Affine M = to_affine(light.light.pose);
    return light.link.valid() ? compose(culler.link_pose(light.link), M) : M;
  };
  for (size_t i = 0; i < suns_.size(); ++i) {
    const Affine M = pose_of(*suns_[i]);
    const Vec3 to_sun = -(M.leftCols<3>() * suns_[i]->light.direction).normalized();
    frame.sun_direction[i] = vec4(to_sun, 0.0);
    frame.sun_colour[i] = light_colour(suns_[i]->light);
    if (i == 0 && counts_.shadow) {
      place_shadow(to_sun, view);
      Eigen::Map<Eigen::Matrix4f>(frame.shadow_from_world.data()) =
          shadow_.map_from_world(eye).cast<float>();
      // Lookups are offset by a texel and a half, so that surfaces do not shadow themselves.
      frame.origin[3] = static_cast<float>(1.5 * 2.0 * shadow_.half / ShadowRegion::kSize);
    }
  }
  for (size_t i = 0; i < lamps_.size(); ++i) {
    const world::Light& light = lamps_[i]->light;
    const Affine M = pose_of(*lamps_[i]);
    frame.lamp_position[i] = vec4(M.col(3) - eye, std::max(light.range, 1e-3));
    frame.lamp_colour[i] = light_colour(light);
    frame.lamp_attenuation[i] =
        vec4({light.constant, light.linear, light.quadratic}, light.falloff);
    frame.lamp_axis[i] = vec4((M.leftCols<3>() * light.direction).normalized(), 0.0);
    frame.lamp_cone[i] =
        vec4({math::cos(0.5 * light.outer_angle), math::cos(0.5 * light.inner_angle), 0.0}, 0.0);
  }
}

void RenderLights::place_shadow(const Vec3& to_sun, const View& view) {
  // The whole world if it is small or seen from outside, otherwise the camera's surroundings.
  const Vec3 eye = view.X_WCamera.translation;
  const Vec3 middle = 0.5 * (content_.bounds.low + content_.bounds.high);
  const double whole = std::max(0.5 * (content_.bounds.high - content_.bounds.low).norm(), 1.0);
  const double outside =
      (eye - eye.cwiseMax(content_.bounds.low).cwiseMin(content_.bounds.high)).norm();
  const double half = std::min(whole, std::max(kShadowReach, outside));
  Vec3 centre = middle;
  if (half < whole) {
    centre = eye + 0.6 * half * (view.X_WCamera.rotation * Vec3::UnitX());
    centre = centre.cwiseMax(content_.bounds.low).cwiseMin(content_.bounds.high);
  }
  const Vec3 right =
      (std::abs(to_sun.z()) > 0.99 ? Vec3::UnitX() : Vec3::UnitZ()).cross(to_sun).normalized();
  const Vec3 up = to_sun.cross(right);
  if (half < whole) {
    // Snapped to a grid of a few metres, so that shadow edges do not swim as the camera moves.
    const double step = 0.2 * half;
    centre = right * step * std::round(centre.dot(right) / step) +
             up * step * std::round(centre.dot(up) / step) +
             to_sun * step * std::round(centre.dot(to_sun) / step);
  }
  const double reach = half + whole;  // along the rays: casters far above count, too
  shadow_.centre = centre;
  shadow_.right = right;
  shadow_.up = up;
  shadow_.to_sun = to_sun;
  shadow_.half = half;
  shadow_.reach = reach;
  shadow_.region.planes.clear();
  for (const auto& [normal, size] : {std::pair{right, half}, {up, half}, {to_sun, reach}}) {
    shadow_.region.planes.push_back({normal, size - normal.dot(centre)});
    shadow_.region.planes.push_back({-normal, size + normal.dot(centre)});
  }
  shadow_.seen = shadow_.region;
  if (half < whole) limit_to(view);  // otherwise all views share the map
}

// To the view's silhouette, as the sun sees it.
void RenderLights::limit_to(const View& view) {
  std::vector<Eigen::Vector2d> points;
  for (const Vec3& corner : corners_of(view))
    points.emplace_back(shadow_.right.dot(corner), shadow_.up.dot(corner));
  const std::vector<Eigen::Vector2d> hull = hull_of(points);
  if (hull.size() < 3) return;
  const double margin = kMarginTexels * 2.0 * shadow_.half / ShadowRegion::kSize;
  for (size_t i = 0; i < hull.size(); ++i) {
    const Eigen::Vector2d edge = (hull[(i + 1) % hull.size()] - hull[i]).normalized();
    const Eigen::Vector2d inwards(-edge.y(), edge.x());
    shadow_.seen.planes.push_back(
        {inwards.x() * shadow_.right + inwards.y() * shadow_.up, margin - inwards.dot(hull[i])});
  }
}

}  // namespace ruedo::scene
