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

// Throws EnvironmentError with the remedy if there is no backend, if RUEDO_RENDERER names an
// unknown one, or in a process that was forked from one with a context; so does make_current()
// there.
std::unique_ptr<GlContext> make_gl_context();

// Settings of Mesa, which reads the environment once, before its first picture: call these while
// there is only one thread. What the user's environment sets already stays.
// The CPU: Mesa draws with its widest vectors, and the width affects the last bits. With these
// settings it treats every x86-64 CPU as one with SSE 4.1, so that pictures are the same
// everywhere, for about a sixth more time; draw_as_fast_as_it_goes() undoes that. No effect on
// other processors and on CPUs without SSE 4.1.
// The cache of compiled shaders: by default its index is mapped into memory, and a full disk ends
// the process (SIGBUS). A database is written like any file, and is faster to read.
void set_up_mesa();
void draw_as_fast_as_it_goes();

// The backends; null with the reason in `why` if one is missing or does not work. The first call
// loads OSMesa.
std::unique_ptr<GlContext> make_osmesa_context(std::string& why);
std::unique_ptr<GlContext> make_egl_context(std::string& why);

}  // namespace ruedo::scene
