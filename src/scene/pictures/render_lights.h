// The lights of a world for one frame: suns, lamps, ambient light, sky, and the region that has
// shadows.
#pragma once

#include <vector>

#include "scene/pictures/render_content.h"
#include "scene/pictures/render_cull.h"
#include "scene/pictures/render_shaders.h"

namespace ruedo::scene {

// The region with shadows from the first sun: a box along its rays.
struct ShadowRegion {
  static constexpr int kSize = 2048;  // side of the shadow map in texels
  Region region;
  Region seen;                 // the part of it whose shadows may be in the view
  Vec3 centre = Vec3::Zero();  // m, world
  Vec3 right = Vec3::UnitX(), up = Vec3::UnitY(), to_sun = Vec3::UnitZ();  // its axes
  double half = 1.0;   // m, half the side length
  double reach = 1.0;  // m, half the length along the rays

  // From world coordinates relative to `origin` to the map: x and y in [-1, 1], depth in [0, 1].
  Eigen::Matrix4d map_from_world(const Vec3& origin) const;
  bool same_place(const ShadowRegion& other) const {
    return centre == other.centre && to_sun == other.to_sun && half == other.half &&
           reach == other.reach;
  }
};

class RenderLights {
 public:
  // Both must outlive it.
  RenderLights(const world::WorldModel& world, const RenderContent& content);

  const LightCounts& counts() const { return counts_; }

  // Writes everything in the frame that concerns light. The culler supplies the links' poses.
  void fill(const Culler& culler, const View& view, FrameBlock& frame);
  const ShadowRegion& shadow() const { return shadow_; }  // of the last fill()

 private:
  void place_shadow(const Vec3& to_sun, const View& view);
  void limit_to(const View& view);

  const world::WorldModel& world_;
  const RenderContent& content_;
  std::vector<const RenderLight*> suns_, lamps_;
  LightCounts counts_;
  ShadowRegion shadow_;
};

}  // namespace ruedo::scene
