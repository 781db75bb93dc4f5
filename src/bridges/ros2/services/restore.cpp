// The inverse of conversions.cpp's write_scan, write_image and write_compressed.
#include "bridges/ros2/services/restore.h"

#include <array>
#include <utility>

#include "bridges/ros2/messages/cdr.h"
#include "ruedo/image_t.hpp"
#include "ruedo/planar_lidar_t.hpp"

namespace ruedo::ros2 {
namespace {

template <class Message>
std::vector<uint8_t> encoded(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

int64_t get_header(CdrReader& in) {
  const auto seconds = in.get<int32_t>();
  const auto nanoseconds = in.get<uint32_t>();
  in.get_text();
  return int64_t{seconds} * 1'000'000 + nanoseconds / 1000;
}

std::vector<uint8_t> scan_of(CdrReader& in) {
  planar_lidar_t scan;
  scan.utime = get_header(in);
  scan.rad0 = in.get<float>();
  in.skip<float>(1);  // where it ends
  scan.radstep = in.get<float>();
  in.skip<float>(4);  // of the device
  scan.ranges = in.get_sequence<float>();
  scan.intensities = in.get_sequence<float>();
  scan.nranges = static_cast<int32_t>(scan.ranges.size());
  scan.nintensities = static_cast<int32_t>(scan.intensities.size());
  return in.good() ? encoded(scan) : std::vector<uint8_t>();
}

int32_t format_of(const std::string& encoding) {
  constexpr std::pair<const char*, int32_t> kFormats[] = {
      {"mono8", image_t::PIXEL_FORMAT_GRAY},
      {"rgb8", image_t::PIXEL_FORMAT_RGB},
      {"bgr8", image_t::PIXEL_FORMAT_BGR},
      {"16UC1", image_t::PIXEL_FORMAT_LE_GRAY16},
      {"32FC1", image_t::PIXEL_FORMAT_FLOAT_GRAY32}};
  for (const auto& [name, format] : kFormats) {
    if (encoding == name) return format;
  }
  return 0;
}

std::vector<uint8_t> finished(const CdrReader& in, image_t& image) {
  image.size = static_cast<int32_t>(image.data.size());
  image.nmetadata = 0;
  return in.good() ? encoded(image) : std::vector<uint8_t>();
}

std::vector<uint8_t> picture_of(CdrReader& in) {
  image_t image;
  image.utime = get_header(in);
  image.height = static_cast<int32_t>(in.get<uint32_t>());
  image.width = static_cast<int32_t>(in.get<uint32_t>());
  image.pixelformat = format_of(in.get_text());
  const bool big_endian = in.get<uint8_t>() != 0;
  image.row_stride = static_cast<int32_t>(in.get<uint32_t>());
  if (image.pixelformat == 0 || big_endian) return {};
  image.data = in.get_sequence<uint8_t>();
  return finished(in, image);
}

// Height and width as a JPEG's frame header has them (ISO/IEC 10918-1, B.2.2); 0 where it has none.
std::array<int32_t, 2> size_of_jpeg(std::span<const uint8_t> bytes) {
  size_t at = 2;
  while (at + 9 <= bytes.size() && bytes[at] == 0xff) {
    const uint8_t marker = bytes[at + 1];
    const bool is_frame =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (is_frame) return {bytes[at + 5] << 8 | bytes[at + 6], bytes[at + 7] << 8 | bytes[at + 8]};
    at += 2 + static_cast<size_t>(bytes[at + 2] << 8 | bytes[at + 3]);
  }
  return {0, 0};
}

std::vector<uint8_t> compressed_picture_of(CdrReader& in) {
  image_t image;
  image.utime = get_header(in);
  if (in.get_text() != "jpeg") return {};
  image.pixelformat = image_t::PIXEL_FORMAT_MJPEG;
  image.row_stride = 0;
  image.data = in.get_sequence<uint8_t>();
  const auto [height, width] = size_of_jpeg(image.data);
  image.height = height;
  image.width = width;
  return finished(in, image);
}

}  // namespace

std::vector<uint8_t> restored(const std::string& type, std::span<const uint8_t> cdr) {
  CdrReader in(cdr);
  if (type == "sensor_msgs/msg/LaserScan") return scan_of(in);
  if (type == "sensor_msgs/msg/Image") return picture_of(in);
  if (type == "sensor_msgs/msg/CompressedImage") return compressed_picture_of(in);
  return {};
}

}  // namespace ruedo::ros2
