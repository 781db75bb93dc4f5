#include "world/mesh/codecs.h"

#include "ruedo/errors.h"
#include "system/late_library.h"
#include "world/mesh/codecs_module.h"

namespace ruedo::world {
namespace {

template <class Function>
Function& codec(const char* name) {
  std::string why;
  auto* function = late_function<Function>(LateLibrary::codecs, name, why);
  if (function == nullptr) throw EnvironmentError("pictures cannot be read or written: " + why);
  return *function;
}

}  // namespace

cv::Mat decode_picture(const void* bytes, size_t size, int how) {
  static auto& decode = codec<decltype(ruedo_decode_picture)>("ruedo_decode_picture");
  cv::Mat picture;
  decode(bytes, size, how, picture);
  return picture;
}

void encode_picture(const std::string& kind, const cv::Mat& picture, std::vector<uint8_t>& bytes,
                    const std::vector<int>& parameters) {
  static auto& encode = codec<decltype(ruedo_encode_picture)>("ruedo_encode_picture");
  encode(kind, picture, bytes, parameters);
}

}  // namespace ruedo::world
