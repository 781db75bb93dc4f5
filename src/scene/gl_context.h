// An OpenGL 3.3 core context without a display: OSMesa, or EGL without a surface. Which one is an
// environment variable's choice (RUEDO_RENDERER=osmesa or egl), else OSMesa where it works, else
// EGL. A context may move from thread to thread, and is current in one at a time only.
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
  virtual Function function(const char* name) const = 0;  // null when there is none
  virtual std::string backend() const = 0;                // "OSMesa", "EGL"
};

// Throws EnvironmentError with the cure when there is no backend, or RUEDO_RENDERER names an
// unknown one.
std::unique_ptr<GlContext> make_gl_context();

// Mesa draws with the widest vectors that a CPU has, and other widths give other last bits. After
// the first of these it takes every x86-64 CPU for one with SSE 4.1, and draws the same everywhere
// for a sixth more time; the second undoes it. Mesa reads the environment before its first picture,
// once: call them while there is one thread. Without effect on other processors, on CPUs without
// SSE 4.1, and where the environment says something of its own (GALLIUM_OVERRIDE_CPU_CAPS).
void draw_the_same_everywhere();
void draw_as_fast_as_it_goes();

// The backends; null when it is not there or does not work here, with the reason in `why`. OSMesa
// is loaded by the first call.
std::unique_ptr<GlContext> make_osmesa_context(std::string& why);
std::unique_ptr<GlContext> make_egl_context(std::string& why);

}  // namespace ruedo::scene
