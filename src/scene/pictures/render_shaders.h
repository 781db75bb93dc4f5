// The renderer's GLSL programs, and the uniform block that a frame gives to all of them.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace ruedo::scene {

// Further lights are ignored, in file order.
constexpr int kMaxDirectionalLights = 2, kMaxLocalLights = 8;

// The uniform block Frame, in std140 layout. Positions are relative to the camera, with the world's
// axes.
struct FrameBlock {
  using Vec4 = std::array<float, 4>;
  std::array<float, 16> clip_from_world;  // column-major
  std::array<float, 16> shadow_from_world;
  Vec4 eye;     // towards the eye: eye.xyz - eye.w * position
  Vec4 origin;  // xy: the camera's position modulo the ground grid, m; z: exposure; w: shadow bias,
                // m
  Vec4 ambient_up, ambient_down;  // light from above and below; linear
  Vec4 sky_top, sky_horizon, sky_ground;
  std::array<Vec4, kMaxDirectionalLights> sun_direction, sun_colour;  // towards the light
  std::array<Vec4, kMaxLocalLights> lamp_position;                    // w: range, m
  std::array<Vec4, kMaxLocalLights> lamp_colour;                      // w: 1 for a spot
  std::array<Vec4, kMaxLocalLights> lamp_attenuation;  // constant, linear, quadratic; w: falloff
  std::array<Vec4, kMaxLocalLights> lamp_axis;         // of a spot; w: unused
  std::array<Vec4, kMaxLocalLights> lamp_cone;  // cosines of the outer and the inner half angle
};

enum class Pass { colour, geometry, shadow };

// The number of lights in a world; constant in the programs.
struct LightCounts {
  int suns = 0, lamps = 0;
  bool shadow = false;  // suns[0] has a shadow map
};

std::string vertex_shader(Pass pass, uint32_t batch_flags);
// cutout: the texture has holes.
std::string fragment_shader(Pass pass, uint32_t batch_flags, bool cutout,
                            const LightCounts& lights);
std::string sky_vertex_shader();
std::string sky_fragment_shader();
std::string line_vertex_shader();
std::string line_fragment_shader();

}  // namespace ruedo::scene
