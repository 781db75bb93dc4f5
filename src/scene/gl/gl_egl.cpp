// The EGL backend: a context without config and surface on Mesa's surfaceless platform.
#include "scene/gl/gl_context.h"

#ifdef RUEDO_EGL

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include "ruedo/errors.h"

namespace ruedo::scene {
namespace {

class EglContext : public GlContext {
 public:
  EglContext(EGLDisplay display, EGLContext context) : display_(display), context_(context) {}
  // The process has a single display, which other contexts may use: it is not terminated.
  ~EglContext() override { eglDestroyContext(display_, context_); }
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  void make_current() override {
    eglBindAPI(EGL_OPENGL_API);  // per-thread state
    if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_FALSE) {
      throw EnvironmentError("EGL refuses to make its context current");
    }
  }
  void release() override {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
  Function function(const char* name) const override { return eglGetProcAddress(name); }
  std::string backend() const override { return "EGL"; }

 private:
  EGLDisplay display_;
  EGLContext context_;
};

}  // namespace

std::unique_ptr<GlContext> make_egl_context(std::string& why) {
  const auto get_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
      eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_display == nullptr) {
    why = "no eglGetPlatformDisplayEXT";
    return nullptr;
  }
  EGLDisplay display = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) == EGL_FALSE) {
    why = "no surfaceless display";
    return nullptr;
  }
  eglBindAPI(EGL_OPENGL_API);
  const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                               3,
                               EGL_CONTEXT_MINOR_VERSION,
                               3,
                               EGL_CONTEXT_OPENGL_PROFILE_MASK,
                               EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                               EGL_NONE};
  EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
  if (context == EGL_NO_CONTEXT) {
    why = "it gives no OpenGL 3.3 core context";
    return nullptr;
  }
  return std::make_unique<EglContext>(display, context);
}

}  // namespace ruedo::scene

#else

namespace ruedo::scene {
std::unique_ptr<GlContext> make_egl_context(std::string& why) {
  why = "not built in (libegl-dev was absent)";
  return nullptr;
}
}  // namespace ruedo::scene

#endif
