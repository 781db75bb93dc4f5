// Width and height of PNG (from IHDR), JPEG (first SOF), BMP (information header), TIFF (first
// directory) and the portable maps. Everything else is not a picture.
#include "world/mesh/picture.h"

#include <algorithm>
#include <cstring>

namespace ruedo::world {
namespace {

// width times height: a few bytes may decode to any number
constexpr int64_t kMostPixelsInAll = 100'000'000;

struct Size {
  int64_t width = 0, height = 0;  // 0: not found
  int64_t white = 255;            // of a portable map, as decoded
};

class Bytes {
 public:
  explicit Bytes(std::span<const uint8_t> bytes) : bytes_(bytes) {}
  size_t size() const { return bytes_.size(); }
  int64_t at(size_t i) const { return i < bytes_.size() ? bytes_[i] : 0; }
  int64_t big16(size_t i) const { return at(i) << 8 | at(i + 1); }
  int64_t big32(size_t i) const { return big16(i) << 16 | big16(i + 2); }
  int64_t little32(size_t i) const {
    return at(i) | at(i + 1) << 8 | at(i + 2) << 16 | at(i + 3) << 24;
  }
  bool begins(const char* text, size_t length) const {
    return bytes_.size() >= length && std::memcmp(bytes_.data(), text, length) == 0;
  }

 private:
  std::span<const uint8_t> bytes_;
};

Size jpeg_size(const Bytes& bytes) {
  for (size_t i = 2; i + 9 < bytes.size();) {
    if (bytes.at(i) != 0xFF) return {};
    const int64_t marker = bytes.at(i + 1);
    if (marker == 0xFF) {  // padding
      ++i;
      continue;
    }
    const bool frame =
        marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (frame) return {bytes.big16(i + 7), bytes.big16(i + 5)};
    if (marker == 0xDA) return {};
    i += 2 + static_cast<size_t>(std::max<int64_t>(bytes.big16(i + 2), 2));
  }
  return {};
}

// Numbers after "P1" to "P6", with optional comments: width and height; of grey and colours, what
// is white. The decoder scales texts ("P2", "P3") of up to 255.
Size portable_size(const Bytes& bytes) {
  int64_t numbers[3] = {0, 0, 0};
  size_t i = 2;
  for (int64_t& number : numbers) {
    while (i < bytes.size() && (bytes.at(i) == '#' || bytes.at(i) <= ' ')) {
      if (bytes.at(i) == '#') {
        while (i < bytes.size() && bytes.at(i) != '\n') ++i;
      } else {
        ++i;
      }
    }
    for (; i < bytes.size() && bytes.at(i) >= '0' && bytes.at(i) <= '9'; ++i)
      number = std::min<int64_t>(number * 10 + bytes.at(i) - '0', int64_t{1} << 40);
  }
  const int64_t kind = bytes.at(1) - '0', white = numbers[2];
  const bool has_none = kind == 1 || kind == 4;
  const bool scaled = (kind == 2 || kind == 3) && white > 0 && white < 255;
  return {numbers[0], numbers[1], has_none || scaled ? 255 : white};
}

// The width and height of the first directory: tags 256 and 257, as 16 or 32 bits.
Size tiff_size(const Bytes& bytes, bool little) {
  const auto at16 = [&](size_t i) {
    return little ? bytes.at(i) | bytes.at(i + 1) << 8 : bytes.big16(i);
  };
  const auto at32 = [&](size_t i) { return little ? bytes.little32(i) : bytes.big32(i); };
  const auto directory = static_cast<size_t>(at32(4));
  Size size;
  for (int64_t entry = 0; entry < at16(directory); ++entry) {
    const size_t i = directory + 2 + 12 * static_cast<size_t>(entry);
    if (i + 12 > bytes.size()) break;
    const int64_t value = at16(i + 2) == 3 ? at16(i + 8) : at32(i + 8);  // 3: 16 bits
    if (at16(i) == 256) size.width = value;
    if (at16(i) == 257) size.height = value;
  }
  return size;
}

Size size_of(const Bytes& bytes) {
  if (bytes.begins("\x89PNG\r\n\x1a\n", 8)) return {bytes.big32(16), bytes.big32(20)};
  if (bytes.begins("\xFF\xD8", 2)) return jpeg_size(bytes);
  if (bytes.begins("BM", 2)) {
    const int64_t height = bytes.little32(22);  // negative: rows run top to bottom
    return {bytes.little32(18), height > INT32_MAX ? (int64_t{1} << 32) - height : height};
  }
  if (bytes.begins("II*\0", 4) || bytes.begins("MM\0*", 4))
    return tiff_size(bytes, bytes.at(0) == 'I');
  if (bytes.size() > 2 && bytes.at(0) == 'P' && bytes.at(1) >= '1' && bytes.at(1) <= '6')
    return portable_size(bytes);
  return {};
}

// Of what has a size; without overflow.
bool is_too_large(const Size& size) { return size.width > kMostPixelsInAll / size.height; }

}  // namespace

int64_t picture_pixels(std::span<const uint8_t> span) {
  const Size size = size_of(Bytes(span));
  if (size.width <= 0 || size.height <= 0 || is_too_large(size)) return 0;
  return size.width * size.height;
}

std::string picture_fault(std::span<const uint8_t> span, int64_t most) {
  const Size size = size_of(Bytes(span));
  // For another kind, only its decoder knows how much memory it needs.
  if (size.width <= 0 || size.height <= 0)
    return "it is not a picture that can be read (pgm, png, jpeg, bmp, tiff)";
  if (size.white != 255 && size.white != 65535)
    return "its white is " + std::to_string(size.white) +
           "; allowed are 255 and 65535: save it with one of these";
  if (size.width <= most && size.height <= most && !is_too_large(size)) return "";
  if (size.width <= most && size.height <= most) {
    return "it has " + std::to_string(size.width) + " x " + std::to_string(size.height) +
           " pixels; allowed are " + std::to_string(kMostPixelsInAll) + " in all";
  }
  return "it has " + std::to_string(size.width) + " x " + std::to_string(size.height) +
         " pixels; allowed are " + std::to_string(most) + " each way";
}

}  // namespace ruedo::world
