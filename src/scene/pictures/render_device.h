// The OpenGL side of the renderer: programs, uploaded meshes and textures, framebuffers, draw
// calls. Its context must be current in the calling thread.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "scene/gl/gl_context.h"
#include "scene/gl/gl_functions.h"
#include "scene/pictures/render_content.h"
#include "scene/pictures/render_cull.h"
#include "scene/pictures/render_shaders.h"

namespace ruedo::scene {

struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // the upper bounds are exclusive
  bool empty() const { return x1 <= x0 || y1 <= y0; }
};

class RenderDevice {
 public:
  // Makes the context current and leaves it so. Uploads the content's meshes and frees their
  // arrays.
  RenderDevice(std::unique_ptr<GlContext> context, RenderContent& content,
               const LightCounts& lights);

  GlContext& context() { return *context_; }
  std::string description() const;

  void set_frame(const FrameBlock& frame);

  // Selects and clears the target of the following draws: a colour picture (`samples` above 1:
  // antialiased), labels, or the shadow map. Depth runs from 1 at the near plane to 0 at the far
  // plane, except in the shadow map.
  void begin_colour(int width, int height, int samples);
  void begin_geometry(int width, int height);
  // Shadow maps are squares of `size` texels. One holds static casters and is kept; the one in use
  // is a copy with the movers drawn on top. `stale`: the area to copy again first.
  void begin_still_shadow(int size);
  void begin_shadow(int size, const PixelBox& stale);

  void draw(Pass pass, const std::vector<Instance>& instances, std::span<const Run> opaque,
            std::span<const Run> transparent = {});
  // Fills the background. Each corner has a clip position and a world direction, 7 floats.
  void draw_sky(const std::array<float, 21>& corners);
  // Draws triangles over the picture where nothing hides them. Each corner has a clip position and
  // a colour, 8 floats.
  void draw_overlay(const std::vector<float>& vertices);

  // Rows from the top, of the last begin_colour() or begin_geometry().
  void read_rgb(uint8_t* rgb);
  void read_depth(float* depth);  // as stored by OpenGL
  void read_labels(uint16_t* labels);

 private:
  struct MeshBuffers {
    GLuint vertex_array = 0;
  };
  struct TextureState {
    GLuint name = 0;
    bool tried = false, holes = false;
  };
  struct Target {
    GLuint framebuffer = 0, resolved = 0;
  };
  struct ShadowMap {
    GLuint framebuffer = 0, texture = 0;
  };
  struct ProgramKey {
    Pass pass;
    uint32_t flags;
    bool cutout;
    auto operator<=>(const ProgramKey&) const = default;
  };

  GLuint compile(const std::string& vertex, const std::string& fragment);
  GLuint program(Pass pass, uint32_t flags, bool cutout);
  void upload(const RenderMesh& mesh);
  const TextureState& texture(TextureIndex index);
  Target& target(int width, int height, int samples, bool labels);
  void attach(GLenum attachment, GLenum format, int width, int height, int samples);
  void make_shadow_map(ShadowMap& map, int size);
  void set_shadow_state(int size);
  void draw_run(Pass pass, const Run& run);

  std::unique_ptr<GlContext> context_;
  GlFunctions gl;
  RenderContent& content_;
  LightCounts lights_;
  std::vector<MeshBuffers> meshes_;
  IndexedVector<TextureIndex, TextureState> textures_;
  std::map<ProgramKey, GLuint> programs_;
  std::map<std::array<int, 4>, Target> targets_;
  GLuint instance_buffer_ = 0, frame_buffer_ = 0, overlay_buffer_ = 0;
  GLuint overlay_array_ = 0, sky_array_ = 0, sky_buffer_ = 0;
  GLuint sky_program_ = 0, line_program_ = 0;
  ShadowMap shadow_, still_shadow_;
  int width_ = 0, height_ = 0;
  bool resolve_ = false;
  Target* current_ = nullptr;
};

}  // namespace ruedo::scene
