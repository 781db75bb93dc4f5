// An OpenGL 3.3 core context without a display: OSMesa, or surfaceless EGL. The environment
// variable RUEDO_RENDERER (osmesa or egl) chooses; otherwise OSMesa if it works, else EGL. A
// context may move between threads, and is current in one at a time.
#pragma once

#include <memory>
#include <string>

namespace ruedo::scene {

class GlContext {
 public:
  using Function = void (*)();

  virtual ~GlContext() = default;
  virtual void make_current() = 0;  // in the calling thread; throws EnvironmentError
  virtual void release() = 0;       // so that another thread may make it current
  virtual Function function(const char* name) const = 0;  // null: not available
  virtual std::string backend() const = 0;                // "OSMesa", "EGL"
};

// Throws EnvironmentError with the remedy without a backend, if RUEDO_RENDERER names an
// unknown one, or in a process that was forked from one with a context; so does make_current()
// there.
std::unique_ptr<GlContext> make_gl_context();

// The backends; null with the reason in `why` if one is missing or does not work. The first call
// loads OSMesa.
std::unique_ptr<GlContext> make_osmesa_context(std::string& why);
std::unique_ptr<GlContext> make_egl_context(std::string& why);

}  // namespace ruedo::scene
