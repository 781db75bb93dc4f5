#include "scene/gl_context.h"

#include <cstdlib>

#include "core/enough_threads.h"
#include "core/late_library.h"
#include "ruedo/errors.h"

namespace ruedo::scene {
namespace {

constexpr const char* kMesasCpu = "GALLIUM_OVERRIDE_CPU_CAPS";
constexpr int kMesasOwnThreads = 4;  // for its caches
bool set_by_us = false;

}  // namespace

void set_up_mesa() {
  ::setenv("MESA_DISK_CACHE_DATABASE", "true", 0);
#ifdef __x86_64__
  if (std::getenv(kMesasCpu) != nullptr || !__builtin_cpu_supports("sse4.1")) return;
  set_by_us = ::setenv(kMesasCpu, "sse4.1", 0) == 0;
#endif
}

void draw_as_fast_as_it_goes() {
  if (set_by_us) ::unsetenv(kMesasCpu);
  set_by_us = false;
}

std::unique_ptr<GlContext> make_osmesa_context(std::string& why) {
#ifdef RUEDO_OSMESA
  auto* make = late_function<GlContext*(std::string&)>(LateLibrary::osmesa,
                                                       "ruedo_make_osmesa_context", why);
  return std::unique_ptr<GlContext>(make == nullptr ? nullptr : make(why));
#else
  why = "not built in (libosmesa6-dev was absent)";
  return nullptr;
#endif
}

std::unique_ptr<GlContext> make_gl_context() {
  const char* wanted = std::getenv("RUEDO_RENDERER");
  const std::string choice = wanted == nullptr ? "" : wanted;
  if (choice != "" && choice != "auto" && choice != "osmesa" && choice != "egl") {
    throw EnvironmentError("RUEDO_RENDERER=" + choice + ": allowed are osmesa, egl and auto");
  }
  // Mesa has one for each core, and waits for ever for those that could not be started.
  require_threads_for_cores(kMesasOwnThreads);
  std::string why_not_osmesa = "not tried", why_not_egl = "not tried";
  if (choice != "egl") {
    if (auto context = make_osmesa_context(why_not_osmesa)) return context;
  }
  if (choice != "osmesa") {
    if (auto context = make_egl_context(why_not_egl)) return context;
  }
  throw EnvironmentError("no renderer for cameras. OSMesa: " + why_not_osmesa + "; EGL: " +
                         why_not_egl + ". Install libosmesa6, or libegl1 with libgl1-mesa-dri");
}

}  // namespace ruedo::scene
