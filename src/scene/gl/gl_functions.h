// The OpenGL functions that the renderer uses, as one table per context.
//
// Names and types are those of Khronos' glcorearb.h; the pointers come from the context's own
// loader, so that OSMesa and EGL need no loading library and link no libGL.
#pragma once

#include <GL/glcorearb.h>

// clang-format off
#define RUEDO_GL_FUNCTIONS(X) \
  X(PFNGLACTIVETEXTUREPROC, ActiveTexture) \
  X(PFNGLATTACHSHADERPROC, AttachShader) \
  X(PFNGLBINDATTRIBLOCATIONPROC, BindAttribLocation) \
  X(PFNGLBINDBUFFERPROC, BindBuffer) \
  X(PFNGLBINDBUFFERBASEPROC, BindBufferBase) \
  X(PFNGLBINDFRAMEBUFFERPROC, BindFramebuffer) \
  X(PFNGLBINDRENDERBUFFERPROC, BindRenderbuffer) \
  X(PFNGLBINDTEXTUREPROC, BindTexture) \
  X(PFNGLBINDVERTEXARRAYPROC, BindVertexArray) \
  X(PFNGLBLENDFUNCPROC, BlendFunc) \
  X(PFNGLBLITFRAMEBUFFERPROC, BlitFramebuffer) \
  X(PFNGLBUFFERDATAPROC, BufferData) \
  X(PFNGLBUFFERSUBDATAPROC, BufferSubData) \
  X(PFNGLCHECKFRAMEBUFFERSTATUSPROC, CheckFramebufferStatus) \
  X(PFNGLCLEARBUFFERFVPROC, ClearBufferfv) \
  X(PFNGLCLEARBUFFERUIVPROC, ClearBufferuiv) \
  X(PFNGLCLIPCONTROLPROC, ClipControl) \
  X(PFNGLCOLORMASKPROC, ColorMask) \
  X(PFNGLCOMPILESHADERPROC, CompileShader) \
  X(PFNGLCREATEPROGRAMPROC, CreateProgram) \
  X(PFNGLCREATESHADERPROC, CreateShader) \
  X(PFNGLCULLFACEPROC, CullFace) \
  X(PFNGLDELETESHADERPROC, DeleteShader) \
  X(PFNGLDEPTHFUNCPROC, DepthFunc) \
  X(PFNGLDEPTHMASKPROC, DepthMask) \
  X(PFNGLDISABLEPROC, Disable) \
  X(PFNGLDRAWARRAYSPROC, DrawArrays) \
  X(PFNGLDRAWBUFFERPROC, DrawBuffer) \
  X(PFNGLDRAWBUFFERSPROC, DrawBuffers) \
  X(PFNGLDRAWELEMENTSINSTANCEDPROC, DrawElementsInstanced) \
  X(PFNGLENABLEPROC, Enable) \
  X(PFNGLENABLEVERTEXATTRIBARRAYPROC, EnableVertexAttribArray) \
  X(PFNGLFRAMEBUFFERRENDERBUFFERPROC, FramebufferRenderbuffer) \
  X(PFNGLFRAMEBUFFERTEXTURE2DPROC, FramebufferTexture2D) \
  X(PFNGLFRONTFACEPROC, FrontFace) \
  X(PFNGLGENBUFFERSPROC, GenBuffers) \
  X(PFNGLGENFRAMEBUFFERSPROC, GenFramebuffers) \
  X(PFNGLGENRENDERBUFFERSPROC, GenRenderbuffers) \
  X(PFNGLGENTEXTURESPROC, GenTextures) \
  X(PFNGLGENVERTEXARRAYSPROC, GenVertexArrays) \
  X(PFNGLGENERATEMIPMAPPROC, GenerateMipmap) \
  X(PFNGLGETERRORPROC, GetError) \
  X(PFNGLGETINTEGERVPROC, GetIntegerv) \
  X(PFNGLGETPROGRAMINFOLOGPROC, GetProgramInfoLog) \
  X(PFNGLGETPROGRAMIVPROC, GetProgramiv) \
  X(PFNGLGETSHADERINFOLOGPROC, GetShaderInfoLog) \
  X(PFNGLGETSHADERIVPROC, GetShaderiv) \
  X(PFNGLGETSTRINGPROC, GetString) \
  X(PFNGLGETUNIFORMBLOCKINDEXPROC, GetUniformBlockIndex) \
  X(PFNGLGETUNIFORMLOCATIONPROC, GetUniformLocation) \
  X(PFNGLLINKPROGRAMPROC, LinkProgram) \
  X(PFNGLPIXELSTOREIPROC, PixelStorei) \
  X(PFNGLPOLYGONOFFSETPROC, PolygonOffset) \
  X(PFNGLREADBUFFERPROC, ReadBuffer) \
  X(PFNGLREADPIXELSPROC, ReadPixels) \
  X(PFNGLRENDERBUFFERSTORAGEPROC, RenderbufferStorage) \
  X(PFNGLRENDERBUFFERSTORAGEMULTISAMPLEPROC, RenderbufferStorageMultisample) \
  X(PFNGLSHADERSOURCEPROC, ShaderSource) \
  X(PFNGLTEXIMAGE2DPROC, TexImage2D) \
  X(PFNGLTEXPARAMETERFVPROC, TexParameterfv) \
  X(PFNGLTEXPARAMETERIPROC, TexParameteri) \
  X(PFNGLUNIFORM1IPROC, Uniform1i) \
  X(PFNGLUNIFORMBLOCKBINDINGPROC, UniformBlockBinding) \
  X(PFNGLUSEPROGRAMPROC, UseProgram) \
  X(PFNGLVERTEXATTRIBDIVISORPROC, VertexAttribDivisor) \
  X(PFNGLVERTEXATTRIBIPOINTERPROC, VertexAttribIPointer) \
  X(PFNGLVERTEXATTRIBPOINTERPROC, VertexAttribPointer) \
  X(PFNGLVIEWPORTPROC, Viewport)
// clang-format on

namespace ruedo::scene {

class GlContext;

struct GlFunctions {
#define RUEDO_GL_MEMBER(type, name) type name = nullptr;
  RUEDO_GL_FUNCTIONS(RUEDO_GL_MEMBER)
#undef RUEDO_GL_MEMBER
};

// Fills the table from the current context. Throws EnvironmentError naming a missing function.
GlFunctions load_gl_functions(const GlContext& context);

}  // namespace ruedo::scene
