// The lights of a world for one frame: suns, lamps, ambient light, sky, and the region that has shadows.
#pragma once

#include <vector>

#include "scene/render_content.h"
#include "scene/render_cull.h"
#include "scene/render_shaders.h"

namespace ruedo::scene {

// Where the first sun's shadows are worked out: a box along its rays.
struct ShadowRegion {
  static constexpr int kSize = 2048;    // texels a side of the shadow map
  Region region;
  Vec3 centre = Vec3::Zero();           // m, world
  double half = 1.0;                    // m, half a side
};

class RenderLights {
 public:
  // Both must outlive it.
  RenderLights(const model::WorldModel& world, const RenderContent& content);

  const LightCounts& counts() const { return counts_; }

  // Writes all of the frame that is about light. The culler has the links' poses.
  void fill(const Culler& culler, const View& view, FrameBlock& frame);
  const ShadowRegion& shadow() const { return shadow_; }    // of the last fill()

 private:
  void place_shadow(const Vec3& to_sun, const View& view, FrameBlock& frame);

  const model::WorldModel& world_;
  const RenderContent& content_;
  std::vector<const RenderLight*> suns_, lamps_;
  LightCounts counts_;
  ShadowRegion shadow_;
};

}  // namespace ruedo::scene
