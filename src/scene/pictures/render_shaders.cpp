#include "scene/pictures/render_shaders.h"

#include "scene/pictures/render_content.h"

namespace ruedo::scene {
namespace {

std::string head(const LightCounts& lights = {}) {
  std::string s = "#version 330 core\n";
  s += "const int kSuns = " + std::to_string(lights.suns) +
       ", kLamps = " + std::to_string(lights.lamps) + ";\n";
  s += "const int kMaxSuns = " + std::to_string(kMaxDirectionalLights) +
       ", kMaxLamps = " + std::to_string(kMaxLocalLights) + ";\n";
  s += R"(
layout(std140) uniform Frame {
  mat4 clip_from_world;
  mat4 shadow_from_world;
  vec4 eye;
  vec4 origin;
  vec4 ambient_up, ambient_down;
  vec4 sky_top, sky_horizon, sky_ground;
  vec4 sun_direction[kMaxSuns], sun_colour[kMaxSuns];
  vec4 lamp_position[kMaxLamps];
  vec4 lamp_colour[kMaxLamps];
  vec4 lamp_attenuation[kMaxLamps];
  vec4 lamp_axis[kMaxLamps];
  vec4 lamp_cone[kMaxLamps];
};
)";
  return s;
}

// Displayed values are the square roots of light: close enough to sRGB's curve, and cheap. Colours
// in files are displayed values.
constexpr const char* kCurve = R"(
vec3 to_light(vec3 c) { return c * c; }
vec3 to_display(vec3 light) { return sqrt(light); }
)";

constexpr const char* kSky = R"(
vec3 sky(vec3 direction) {
  float h = direction.z;
  vec3 above = mix(sky_horizon.rgb, sky_top.rgb, sqrt(max(h, 0.0)));
  return h >= 0.0 ? above : mix(sky_horizon.rgb, sky_ground.rgb, min(-8.0 * h, 1.0));
}
)";

constexpr const char* kSurface = "in vec2 v_uv;\nuniform sampler2D surface;\n";

// Grid lines of one metre, fading where they would be finer than a pixel.
constexpr const char* kGrid = R"(
  vec2 grid = v_position.xy + origin.xy;
  vec2 width = fwidth(grid);
  vec2 line = clamp((0.012 + 0.5 * width - abs(fract(grid + 0.5) - 0.5)) / width, 0.0, 1.0);
  vec2 tile = step(vec2(1.0), fract(0.5 * grid) * 2.0);
  float fade = clamp(1.4 - 3.0 * max(width.x, width.y), 0.0, 1.0);
  float odd = abs(tile.x - tile.y);
  albedo *= 1.0 - fade * (0.035 * odd + 0.09 * max(line.x, line.y) * clamp(0.03 / max(width.x, width.y), 0.0, 1.0));
)";

constexpr const char* kAmbient = R"(
  vec3 n = normalize(v_normal);
  if (!gl_FrontFacing) n = -n;
  vec3 light = mix(ambient_down.rgb, ambient_up.rgb, 0.5 + 0.5 * dot(n, vec3(0.30, 0.20, 0.933)));
)";

// The first sun has the shadow map.
constexpr const char* kShadow = R"(    if (i == 0) {
      vec4 q = shadow_from_world * vec4(v_position + origin.w * n, 1.0);
      vec3 at = vec3(0.5 + 0.5 * q.xy, q.z);
      facing *= texture(shadow_map, at);
    }
)";

constexpr const char* kLamp = R"(    vec3 way = lamp_position[i].xyz - v_position;
    float d = length(way);
    vec3 to_light_source = way / max(d, 1e-3);
    vec3 k = lamp_attenuation[i].xyz;
    float near = clamp(1.0 - d / lamp_position[i].w, 0.0, 1.0);
    float strength = min(4.0 * near, 1.0) / max(k.x + d * (k.y + d * k.z), 1e-3);
    float c = dot(-to_light_source, lamp_axis[i].xyz);
    float cone = clamp((c - lamp_cone[i].x) / max(lamp_cone[i].y - lamp_cone[i].x, 1e-3), 0.0, 1.0);
    strength *= mix(1.0, cone, lamp_colour[i].w);
    strength *= max(dot(n, to_light_source), 0.0);
    light += strength * lamp_colour[i].rgb;
)";

// Encloses a unit sphere by the meshes that are drawn for it, also by the one of few segments:
// those touch it from inside.
constexpr const char* kEnclosing = "  p.xyz *= 1.12;\n";

// The ray to a point of what encloses the unit sphere, in the mesh's coordinates and in the
// world's.
constexpr const char* kRayOfVertex = R"(
  mat3 from_mesh = transpose(mat3(a_row0.xyz, a_row1.xyz, a_row2.xyz));
  mat3 to_mesh = inverse(from_mesh);
  v_position = position;
  v_eye = to_mesh * (eye.w > 0.0 ? -vec3(a_row0.w, a_row1.w, a_row2.w) : eye.xyz);
  v_point = p.xyz;
)";
constexpr const char* kRay = R"(
  vec3 way = eye.w > 0.0 ? v_point - v_eye : -v_eye;
  vec3 from = eye.w > 0.0 ? v_eye : v_point;
  float length2 = dot(way, way);
  float nearest = -dot(from, way) / length2;
  vec3 aside = from + nearest * way;
  float inside = 1.0 - dot(aside, aside);
  if (inside < 0.0) discard;
  float along = nearest - sqrt(inside / length2);
  if (eye.w > 0.0 && along <= 0.0) discard;
  vec3 hit = eye.w > 0.0 ? along * v_position : v_position - along * eye.xyz;
  vec4 clip = clip_from_world * vec4(hit, 1.0);
  gl_FragDepth = clip.z / clip.w;
  if (gl_FragDepth < 0.0 || gl_FragDepth > 1.0) discard;
)";

// Draws the labels of things.
std::string label_shader(uint32_t flags, bool cutout, const LightCounts& lights) {
  std::string s = head(lights);
  if ((flags & kTextured) != 0) s += kSurface;
  if ((flags & kRound) != 0) s += "in vec3 v_position, v_point;\nflat in vec3 v_eye;\n";
  s += "flat in uint v_label;\nlayout(location = 0) out uint o_label;\nvoid main() {\n";
  if ((flags & kRound) != 0) s += kRay;
  if (cutout) s += "  if (texture(surface, v_uv).a < 0.5) discard;\n";
  return s + "  o_label = v_label;\n}\n";
}

std::string colour_declarations(uint32_t flags, const LightCounts& lights) {
  std::string s = head(lights);
  if ((flags & kTextured) != 0) s += kSurface;
  s += kCurve;
  s +=
      "in vec3 v_position;\nin vec3 v_normal;\nflat in vec4 v_diffuse;\nflat in vec4 v_emissive;\n";
  if ((flags & kSpecular) != 0) s += "flat in vec4 v_specular;\n";
  if ((flags & kGround) != 0) s += std::string("in vec2 v_plane;\n") + kSky;
  if (lights.shadow) s += "uniform sampler2DShadow shadow_map;\n";
  return s + "layout(location = 0) out vec4 o_colour;\n";
}

// Computes `light`, and `shine` for specular surfaces, from ambient light, suns and lamps.
std::string lighting(bool specular, bool shadow) {
  const auto highlight = [&](const std::string& colour) {
    return specular ? "    shine += " + colour +
                          " * pow(max(dot(n, normalize(to_light_source + to_eye)), 1e-4), "
                          "v_specular.w);\n"
                    : std::string();
  };
  std::string s = kAmbient;
  if (specular)
    s += "  vec3 shine = vec3(0.0);\n  vec3 to_eye = normalize(eye.xyz - eye.w * v_position);\n";
  s += "  for (int i = 0; i < kSuns; ++i) {\n    vec3 to_light_source = sun_direction[i].xyz;\n"
       "    float facing = max(dot(n, to_light_source), 0.0);\n";
  if (shadow) s += kShadow;
  s += "    light += facing * sun_colour[i].rgb;\n" + highlight("facing * sun_colour[i].rgb");
  s += "  }\n  for (int i = 0; i < kLamps; ++i) {\n";
  s += kLamp + highlight("strength * lamp_colour[i].rgb");
  return s + "  }\n";
}

}  // namespace

std::string vertex_shader(Pass pass, uint32_t flags) {
  std::string s = head();
  s += R"(
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in vec2 a_uv;
layout(location = 3) in vec4 a_row0;
layout(location = 4) in vec4 a_row1;
layout(location = 5) in vec4 a_row2;
layout(location = 6) in vec4 a_diffuse;
layout(location = 7) in vec4 a_specular;
layout(location = 8) in vec4 a_emissive;
layout(location = 9) in uint a_label;
)";
  if (pass != Pass::shadow && (flags & kTextured) != 0) s += "out vec2 v_uv;\n";
  if (pass == Pass::geometry) s += "flat out uint v_label;\n";
  if ((flags & kRound) != 0) s += "out vec3 v_position, v_point;\nflat out vec3 v_eye;\n";
  if (pass == Pass::colour) {
    s += "out vec3 v_position;\nout vec3 v_normal;\nflat out vec4 v_diffuse;\nflat out vec4 "
         "v_emissive;\n";
    if ((flags & kSpecular) != 0) s += "flat out vec4 v_specular;\n";
    if ((flags & kGround) != 0) s += "out vec2 v_plane;\n";
  }
  s += R"(
void main() {
  vec4 p = vec4(a_position, 1.0);
)";
  if ((flags & kRound) != 0) s += kEnclosing;
  s += "  vec3 position = vec3(dot(a_row0, p), dot(a_row1, p), dot(a_row2, p));\n";
  if ((flags & kRound) != 0) s += kRayOfVertex;
  if (pass == Pass::shadow)
    return s + "  gl_Position = shadow_from_world * vec4(position, 1.0);\n}\n";
  s += "  gl_Position = clip_from_world * vec4(position, 1.0);\n";
  if ((flags & kTextured) != 0) s += "  v_uv = a_uv;\n";
  if (pass == Pass::geometry) s += "  v_label = a_label;\n";
  if (pass == Pass::colour) {
    // The cofactor matrix transforms normals like the inverse transpose, and also works for flat
    // and mirrored scales.
    s += R"(
  v_position = position;
  vec3 c0 = cross(a_row1.xyz, a_row2.xyz), c1 = cross(a_row2.xyz, a_row0.xyz), c2 = cross(a_row0.xyz, a_row1.xyz);
  v_normal = normalize(vec3(dot(c0, a_normal), dot(c1, a_normal), dot(c2, a_normal)));
  v_diffuse = a_diffuse;
  v_emissive = a_emissive;
)";
    if ((flags & kMirrored) != 0) s += "  v_normal = -v_normal;\n";
    if ((flags & kSpecular) != 0) s += "  v_specular = a_specular;\n";
    if ((flags & kGround) != 0) s += "  v_plane = 2.0 * a_position.xy;\n";
  }
  return s + "}\n";
}

std::string fragment_shader(Pass pass, uint32_t flags, bool cutout, const LightCounts& lights) {
  switch (pass) {
    case Pass::shadow: return head(lights) + "void main() {}\n";
    case Pass::geometry: return label_shader(flags, cutout, lights);
    case Pass::colour: break;
  }
  const bool specular = (flags & kSpecular) != 0, ground = (flags & kGround) != 0;
  std::string s = colour_declarations(flags, lights);
  s += "void main() {\n  vec3 albedo = v_diffuse.rgb;\n";
  if ((flags & kTextured) != 0) {
    s += "  vec4 texel = texture(surface, v_uv);\n";
    if (cutout) s += "  if (texel.a < 0.5) discard;\n";
    s += "  albedo *= texel.rgb;\n";
  }
  if (ground) s += kGrid;
  s += lighting(specular, lights.shadow);
  // Compresses light beyond the displayable range softly.
  s += R"(
  vec3 over = max(light - 0.8, vec3(0.0));
  light = min(light, vec3(0.8)) + over / (1.0 + over);
  vec3 colour = to_light(albedo) * light + to_light(v_emissive.rgb);
)";
  if (specular) s += "  colour += 0.4 * to_light(v_specular.rgb) * shine;\n";
  if (ground) {
    s += "  float edge = smoothstep(0.55, 1.0, length(v_plane));\n"
         "  colour = mix(colour, sky_horizon.rgb, edge);\n";
  }
  return s + "  o_colour = vec4(to_display(colour * origin.z), v_diffuse.a);\n}\n";
}

std::string sky_vertex_shader() {
  return head() + R"(
layout(location = 0) in vec4 a_corner;     // clip coordinates
layout(location = 1) in vec3 a_direction;  // world
out vec3 v_direction;
void main() {
  v_direction = a_direction;
  gl_Position = a_corner;
}
)";
}

std::string sky_fragment_shader() {
  return head() + kCurve + kSky + R"(
in vec3 v_direction;
layout(location = 0) out vec4 o_colour;
void main() { o_colour = vec4(to_display(sky(normalize(v_direction)) * origin.z), 1.0); }
)";
}

std::string line_vertex_shader() {
  return head() + R"(
layout(location = 0) in vec4 a_position;    // clip coordinates
layout(location = 1) in vec4 a_colour;
flat out vec4 v_colour;
void main() {
  v_colour = a_colour;
  gl_Position = a_position;
}
)";
}

std::string line_fragment_shader() {
  return head() + R"(
flat in vec4 v_colour;
layout(location = 0) out vec4 o_colour;
void main() { o_colour = v_colour; }
)";
}

}  // namespace ruedo::scene
