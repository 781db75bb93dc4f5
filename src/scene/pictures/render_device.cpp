#include "scene/pictures/render_device.h"

#include <cstddef>

#include "ruedo/errors.h"
#include "scene/pictures/render_texture.h"

namespace ruedo::scene {
namespace {

constexpr GLuint kFrameBinding = 0;
constexpr GLuint kFirstInstanceAttribute = 3;

bool is_traced(Pass pass, uint32_t flags, bool cutout) {
  return pass == Pass::geometry && (flags & kRound) != 0 && !cutout;
}

const void* offset(size_t bytes) { return reinterpret_cast<const void*>(bytes); }

}  // namespace

RenderDevice::RenderDevice(std::unique_ptr<GlContext> context, RenderContent& content,
                           const LightCounts& lights)
    : context_(std::move(context)),
      content_(content),
      lights_(lights),
      textures_(content.textures.size()) {
  context_->make_current();
  gl = load_gl_functions(*context_);
  gl.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl.GenBuffers(1, &instance_buffer_);
  gl.GenBuffers(1, &frame_buffer_);
  gl.GenBuffers(1, &overlay_buffer_);
  gl.GenBuffers(1, &sky_buffer_);
  gl.GenVertexArrays(1, &overlay_array_);
  gl.GenVertexArrays(1, &sky_array_);
  for (RenderMesh& mesh : content.meshes) {
    upload(mesh);
    mesh.vertices = {};
    mesh.indices = {};
  }
  gl.BindVertexArray(overlay_array_);
  gl.BindBuffer(GL_ARRAY_BUFFER, overlay_buffer_);
  for (GLuint i = 0; i < 2; ++i) {
    gl.EnableVertexAttribArray(i);
    gl.VertexAttribPointer(i, 4, GL_FLOAT, GL_FALSE, 8 * sizeof(float),
                           offset(4 * i * sizeof(float)));
  }
  gl.BindVertexArray(sky_array_);
  gl.BindBuffer(GL_ARRAY_BUFFER, sky_buffer_);
  for (GLuint i = 0; i < 2; ++i) {
    gl.EnableVertexAttribArray(i);
    gl.VertexAttribPointer(i, i == 0 ? 4 : 3, GL_FLOAT, GL_FALSE, 7 * sizeof(float),
                           offset(4 * i * sizeof(float)));
  }
  gl.BindVertexArray(0);
  sky_program_ = compile(sky_vertex_shader(), sky_fragment_shader());
  line_program_ = compile(line_vertex_shader(), line_fragment_shader());
}

std::string RenderDevice::description() const {
  const auto text = [&](GLenum what) {
    return std::string(reinterpret_cast<const char*>(gl.GetString(what)));
  };
  return context_->backend() + ": " + text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
}

GLuint RenderDevice::compile(const std::string& vertex, const std::string& fragment) {
  const GLuint program = gl.CreateProgram();
  for (const auto& [type, text] :
       {std::pair{GL_VERTEX_SHADER, &vertex}, std::pair{GL_FRAGMENT_SHADER, &fragment}}) {
    const GLuint shader = gl.CreateShader(static_cast<GLenum>(type));
    const char* source = text->c_str();
    gl.ShaderSource(shader, 1, &source, nullptr);
    gl.CompileShader(shader);
    GLint good = 0;
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &good);
    if (good == 0) {
      char log[2048] = "";
      gl.GetShaderInfoLog(shader, sizeof log, nullptr, log);
      throw EnvironmentError("the renderer refuses a shader of ours: " + std::string(log));
    }
    gl.AttachShader(program, shader);
    gl.DeleteShader(shader);
  }
  gl.LinkProgram(program);
  GLint good = 0;
  gl.GetProgramiv(program, GL_LINK_STATUS, &good);
  if (good == 0) {
    char log[2048] = "";
    gl.GetProgramInfoLog(program, sizeof log, nullptr, log);
    throw EnvironmentError("the renderer refuses a program of ours: " + std::string(log));
  }
  const GLuint block = gl.GetUniformBlockIndex(program, "Frame");
  if (block != GL_INVALID_INDEX) gl.UniformBlockBinding(program, block, kFrameBinding);
  gl.UseProgram(program);
  // Unit 0 is a part's texture, unit 1 the shadow map. Uniforms that a program does not use are
  // skipped.
  gl.Uniform1i(gl.GetUniformLocation(program, "surface"), 0);
  gl.Uniform1i(gl.GetUniformLocation(program, "shadow_map"), 1);
  return program;
}

GLuint RenderDevice::program(Pass pass, uint32_t flags, bool cutout) {
  // Batches that differ only in what a pass does not look at share an entry.
  uint32_t used = flags & (kTextured | kSpecular | kGround | kMirrored);
  if (pass != Pass::colour) used = cutout && pass == Pass::geometry ? uint32_t{kTextured} : 0u;
  if (is_traced(pass, flags, cutout)) used |= kRound;
  const ProgramKey key{pass, used, cutout && (used & kTextured) != 0};
  const auto [at, inserted] = programs_.try_emplace(key, 0);
  if (inserted)
    at->second =
        compile(vertex_shader(pass, used), fragment_shader(pass, used, key.cutout, lights_));
  return at->second;
}

void RenderDevice::upload(const RenderMesh& mesh) {
  MeshBuffers& buffers = meshes_.emplace_back();
  GLuint names[2];
  gl.GenVertexArrays(1, &buffers.vertex_array);
  gl.GenBuffers(2, names);
  gl.BindVertexArray(buffers.vertex_array);
  gl.BindBuffer(GL_ARRAY_BUFFER, names[0]);
  gl.BufferData(GL_ARRAY_BUFFER,
                static_cast<GLsizeiptr>(mesh.vertices.size() * sizeof(RenderVertex)),
                mesh.vertices.data(), GL_STATIC_DRAW);
  gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, names[1]);
  gl.BufferData(GL_ELEMENT_ARRAY_BUFFER,
                static_cast<GLsizeiptr>(mesh.indices.size() * sizeof(uint32_t)),
                mesh.indices.data(), GL_STATIC_DRAW);
  const auto attribute = [&](GLuint index, int size, size_t at) {
    gl.EnableVertexAttribArray(index);
    gl.VertexAttribPointer(index, size, GL_FLOAT, GL_FALSE, sizeof(RenderVertex), offset(at));
  };
  attribute(0, 3, offsetof(RenderVertex, position));
  attribute(1, 3, offsetof(RenderVertex, normal));
  attribute(2, 2, offsetof(RenderVertex, uv));
  for (GLuint i = kFirstInstanceAttribute; i < kFirstInstanceAttribute + 7; ++i) {
    gl.EnableVertexAttribArray(i);
    gl.VertexAttribDivisor(i, 1);
  }
}

const RenderDevice::TextureState& RenderDevice::texture(TextureIndex index) {
  TextureState& state = textures_[index];
  if (state.tried) return state;
  state.tried = true;
  const TexturePixels pixels = decode_texture(*content_.textures[index]);
  if (pixels.width == 0) return state;
  state.holes = pixels.holes;
  gl.GenTextures(1, &state.name);
  gl.ActiveTexture(GL_TEXTURE0);
  gl.BindTexture(GL_TEXTURE_2D, state.name);
  gl.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, pixels.width, pixels.height, 0, GL_RGBA,
                GL_UNSIGNED_BYTE, pixels.rgba.data());
  gl.GenerateMipmap(GL_TEXTURE_2D);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  return state;
}

void RenderDevice::set_frame(const FrameBlock& frame) {
  gl.BindBuffer(GL_UNIFORM_BUFFER, frame_buffer_);
  gl.BufferData(GL_UNIFORM_BUFFER, sizeof frame, &frame, GL_STREAM_DRAW);
  gl.BindBufferBase(GL_UNIFORM_BUFFER, kFrameBinding, frame_buffer_);
}

void RenderDevice::attach(GLenum attachment, GLenum format, int width, int height, int samples) {
  GLuint name = 0;
  gl.GenRenderbuffers(1, &name);
  gl.BindRenderbuffer(GL_RENDERBUFFER, name);
  if (samples > 1) {
    gl.RenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, width, height);
  } else {
    gl.RenderbufferStorage(GL_RENDERBUFFER, format, width, height);
  }
  gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, name);
}

RenderDevice::Target& RenderDevice::target(int width, int height, int samples, bool labels) {
  const auto [at, inserted] = targets_.try_emplace({width, height, samples, labels ? 1 : 0});
  Target& target = at->second;
  if (!inserted) return target;
  const GLenum format = labels ? GLenum{GL_R16UI} : GLenum{GL_RGBA8};
  if (samples > 1) {
    gl.GenFramebuffers(1, &target.resolved);
    gl.BindFramebuffer(GL_FRAMEBUFFER, target.resolved);
    attach(GL_COLOR_ATTACHMENT0, format, width, height, 1);
  }
  gl.GenFramebuffers(1, &target.framebuffer);
  gl.BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
  attach(GL_COLOR_ATTACHMENT0, format, width, height, samples);
  attach(GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, width, height, samples);
  if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw EnvironmentError("the renderer cannot draw pictures of " + std::to_string(width) + " x " +
                           std::to_string(height) + " pixels");
  }
  return target;
}

void RenderDevice::begin_colour(int width, int height, int samples) {
  current_ = &target(width, height, samples, false);
  width_ = width;
  height_ = height;
  resolve_ = samples > 1;
  gl.BindFramebuffer(GL_FRAMEBUFFER, current_->framebuffer);
  gl.Viewport(0, 0, width, height);
  gl.DepthMask(GL_TRUE);
  const float far_depth = 0.0f;
  gl.ClearBufferfv(GL_DEPTH, 0, &far_depth);  // colours need no clearing: the sky fills the rest
  gl.Enable(GL_DEPTH_TEST);
  gl.DepthFunc(GL_GREATER);
  gl.Disable(GL_BLEND);
  gl.Disable(GL_POLYGON_OFFSET_FILL);
}

void RenderDevice::begin_geometry(int width, int height) {
  current_ = &target(width, height, 1, true);
  width_ = width;
  height_ = height;
  resolve_ = false;
  gl.BindFramebuffer(GL_FRAMEBUFFER, current_->framebuffer);
  gl.Viewport(0, 0, width, height);
  gl.DepthMask(GL_TRUE);
  const float far_depth = 0.0f;
  const GLuint nothing[4] = {0, 0, 0, 0};
  gl.ClearBufferfv(GL_DEPTH, 0, &far_depth);
  gl.ClearBufferuiv(GL_COLOR, 0, nothing);
  gl.Enable(GL_DEPTH_TEST);
  gl.DepthFunc(GL_GREATER);
  gl.Disable(GL_BLEND);
  gl.Disable(GL_POLYGON_OFFSET_FILL);
}

void RenderDevice::make_shadow_map(ShadowMap& map, int size) {
  gl.ActiveTexture(GL_TEXTURE1);
  gl.GenTextures(1, &map.texture);
  gl.BindTexture(GL_TEXTURE_2D, map.texture);
  gl.TexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT16, size, size, 0, GL_DEPTH_COMPONENT,
                GL_UNSIGNED_SHORT, nullptr);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  // No shadow outside the map.
  const float lit[4] = {1.0f, 1.0f, 1.0f, 1.0f};
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  gl.TexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_BORDER_COLOR, lit);
  gl.GenFramebuffers(1, &map.framebuffer);
  gl.BindFramebuffer(GL_FRAMEBUFFER, map.framebuffer);
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, map.texture, 0);
  gl.DrawBuffer(GL_NONE);
  gl.ReadBuffer(GL_NONE);
}

void RenderDevice::begin_still_shadow(int size) {
  if (still_shadow_.texture == 0) {
    make_shadow_map(still_shadow_, size);
    make_shadow_map(shadow_, size);  // the one made last stays bound to unit 1
    gl.ActiveTexture(GL_TEXTURE0);
  }
  gl.BindFramebuffer(GL_FRAMEBUFFER, still_shadow_.framebuffer);
  gl.DepthMask(GL_TRUE);
  const float far_depth = 1.0f;
  gl.ClearBufferfv(GL_DEPTH, 0, &far_depth);
  set_shadow_state(size);
}

void RenderDevice::begin_shadow(int size, const PixelBox& stale) {
  if (!stale.empty()) {
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, still_shadow_.framebuffer);
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, shadow_.framebuffer);
    gl.BlitFramebuffer(stale.x0, stale.y0, stale.x1, stale.y1, stale.x0, stale.y0, stale.x1,
                       stale.y1, GL_DEPTH_BUFFER_BIT, GL_NEAREST);
  }
  gl.BindFramebuffer(GL_FRAMEBUFFER, shadow_.framebuffer);
  set_shadow_state(size);
}

void RenderDevice::set_shadow_state(int size) {
  gl.Viewport(0, 0, size, size);
  gl.DepthMask(GL_TRUE);
  gl.Enable(GL_DEPTH_TEST);
  gl.DepthFunc(GL_LESS);
  gl.Disable(GL_BLEND);
  gl.Enable(GL_POLYGON_OFFSET_FILL);
  gl.PolygonOffset(2.0f, 2.0f);
}

void RenderDevice::draw_run(Pass pass, const Run& run) {
  const Batch& batch = content_.batches[run.batch];
  uint32_t flags = batch.flags;
  bool cutout = false;
  if (batch.texture.valid() && pass != Pass::shadow) {
    const TextureState& state = texture(batch.texture);
    if (state.name == 0) {
      flags &= ~uint32_t{kTextured};
    } else {
      gl.ActiveTexture(GL_TEXTURE0);
      gl.BindTexture(GL_TEXTURE_2D, state.name);
      cutout = state.holes;
    }
  }
  gl.UseProgram(program(pass, flags, cutout));
  // Thin and open things cast shadows from both sides.
  if ((flags & kDoubleSided) != 0 || cutout || pass == Pass::shadow) {
    gl.Disable(GL_CULL_FACE);
  } else {
    gl.Enable(GL_CULL_FACE);
  }
  // Rows run from the top, so that pictures need no flipping: outside faces are clockwise in
  // OpenGL's window. Rays are traced through the back faces of what encloses a round shape: the eye
  // may be close to it, and the planes that clip in between.
  const bool traced = is_traced(pass, flags, cutout);
  gl.FrontFace(((flags & kMirrored) != 0) != traced ? GL_CCW : GL_CW);
  if (traced) gl.Enable(GL_DEPTH_CLAMP);
  gl.BindVertexArray(meshes_[batch.mesh].vertex_array);
  const size_t at = run.first * sizeof(Instance);
  const auto attribute = [&](GLuint index, size_t member) {
    gl.VertexAttribPointer(index, 4, GL_FLOAT, GL_FALSE, sizeof(Instance), offset(at + member));
  };
  for (GLuint r = 0; r < 3; ++r) attribute(3 + r, offsetof(Instance, rows) + r * 4 * sizeof(float));
  attribute(6, offsetof(Instance, diffuse));
  attribute(7, offsetof(Instance, specular));
  attribute(8, offsetof(Instance, emissive));
  gl.VertexAttribIPointer(9, 1, GL_UNSIGNED_INT, sizeof(Instance),
                          offset(at + offsetof(Instance, label)));
  gl.DrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(batch.index_count), GL_UNSIGNED_INT,
                           offset(batch.first_index * sizeof(uint32_t)),
                           static_cast<GLsizei>(run.count));
  if (traced) gl.Disable(GL_DEPTH_CLAMP);
}

void RenderDevice::draw(Pass pass, const std::vector<Instance>& instances,
                        std::span<const Run> opaque, std::span<const Run> transparent) {
  gl.BindBuffer(GL_ARRAY_BUFFER, instance_buffer_);
  gl.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(instances.size() * sizeof(Instance)),
                instances.data(), GL_STREAM_DRAW);
  for (const Run& run : opaque) draw_run(pass, run);
  if (transparent.empty()) return;
  gl.Enable(GL_BLEND);
  gl.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  gl.DepthMask(GL_FALSE);
  for (const Run& run : transparent) draw_run(pass, run);
  gl.DepthMask(GL_TRUE);
  gl.Disable(GL_BLEND);
}

void RenderDevice::draw_sky(const std::array<float, 21>& corners) {
  gl.BindVertexArray(sky_array_);
  gl.BindBuffer(GL_ARRAY_BUFFER, sky_buffer_);
  gl.BufferData(GL_ARRAY_BUFFER, sizeof corners, corners.data(), GL_STREAM_DRAW);
  gl.UseProgram(sky_program_);
  gl.Disable(GL_CULL_FACE);
  gl.DepthFunc(GL_EQUAL);  // depth 0 is where nothing was drawn
  gl.DepthMask(GL_FALSE);
  gl.DrawArrays(GL_TRIANGLES, 0, 3);
  gl.DepthMask(GL_TRUE);
  gl.DepthFunc(GL_GREATER);
}

void RenderDevice::draw_overlay(const std::vector<float>& vertices) {
  const auto count = static_cast<GLsizei>(vertices.size() / 8);
  gl.BindVertexArray(overlay_array_);
  gl.BindBuffer(GL_ARRAY_BUFFER, overlay_buffer_);
  gl.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(float)),
                vertices.data(), GL_STREAM_DRAW);
  gl.UseProgram(line_program_);
  gl.Disable(GL_CULL_FACE);
  gl.Enable(GL_BLEND);
  gl.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  gl.DepthMask(GL_FALSE);
  gl.DepthFunc(GL_GEQUAL);
  gl.DrawArrays(GL_TRIANGLES, 0, count);
  gl.DepthMask(GL_TRUE);
  gl.Disable(GL_BLEND);
  gl.DepthFunc(GL_GREATER);
}

void RenderDevice::read_rgb(uint8_t* rgb) {
  if (resolve_) {
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, current_->framebuffer);
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, current_->resolved);
    gl.BlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT,
                       GL_NEAREST);
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, current_->resolved);
  }
  gl.ReadPixels(0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, rgb);
}

void RenderDevice::read_depth(float* depth) {
  gl.ReadPixels(0, 0, width_, height_, GL_DEPTH_COMPONENT, GL_FLOAT, depth);
}

void RenderDevice::read_labels(uint16_t* labels) {
  gl.ReadPixels(0, 0, width_, height_, GL_RED_INTEGER, GL_UNSIGNED_SHORT, labels);
}

}  // namespace ruedo::scene
