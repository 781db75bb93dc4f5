#include "scene/gl/gl_functions.h"

#include <string>

#include "ruedo/errors.h"
#include "scene/gl/gl_context.h"

namespace ruedo::scene {

GlFunctions load_gl_functions(const GlContext& context) {
  GlFunctions gl;
#define RUEDO_GL_LOAD(type, name)                                                        \
  gl.name = reinterpret_cast<type>(context.function("gl" #name));                        \
  if (gl.name == nullptr) {                                                              \
    throw EnvironmentError("the renderer " + context.backend() +                         \
                           " has no gl" #name                                            \
                           ": Mesa 20 or newer is needed (apt: libosmesa6 or libegl1)"); \
  }
  RUEDO_GL_FUNCTIONS(RUEDO_GL_LOAD)
#undef RUEDO_GL_LOAD
  return gl;
}

}  // namespace ruedo::scene
