// libruedo_osmesa.so, the OSMesa backend: Mesa's software renderer in this process, with no driver
// and no device. A library of its own, since Mesa's compiler takes long to load.
#include "scene/gl/gl_context.h"

#include <array>
#include <cstdint>

#include <GL/osmesa.h>

#include "ruedo/errors.h"

namespace ruedo::scene {
namespace {

class OsMesaContext : public GlContext {
 public:
  explicit OsMesaContext(OSMesaContext context) : context_(context) {}
  ~OsMesaContext() override { OSMesaDestroyContext(context_); }
  OsMesaContext(const OsMesaContext&) = delete;
  OsMesaContext& operator=(const OsMesaContext&) = delete;

  void make_current() override {
    if (OSMesaMakeCurrent(context_, unused_.data(), GL_UNSIGNED_BYTE, kSize, kSize) == GL_FALSE) {
      throw EnvironmentError("OSMesa refuses to make its context current");
    }
  }
  void release() override { OSMesaMakeCurrent(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0); }
  Function function(const char* name) const override { return OSMesaGetProcAddress(name); }
  std::string backend() const override { return "OSMesa"; }

 private:
  static constexpr int kSize =
      16;  // OSMesa needs a buffer of its own; everything is drawn to framebuffer objects
  OSMesaContext context_;
  std::array<uint8_t, 4 * kSize * kSize> unused_{};
};

}  // namespace
}  // namespace ruedo::scene

// Null, with the reason in `why`; otherwise owned by the caller.
extern "C" ruedo::scene::GlContext* ruedo_make_osmesa_context(std::string& why) {
  const int attributes[] = {OSMESA_FORMAT,
                            OSMESA_RGBA,
                            OSMESA_PROFILE,
                            OSMESA_CORE_PROFILE,
                            OSMESA_CONTEXT_MAJOR_VERSION,
                            3,
                            OSMESA_CONTEXT_MINOR_VERSION,
                            3,
                            0};
  OSMesaContext context = OSMesaCreateContextAttribs(attributes, nullptr);
  if (context == nullptr) {
    why = "it gives no OpenGL 3.3 core context";
    return nullptr;
  }
  return new ruedo::scene::OsMesaContext(context);
}
