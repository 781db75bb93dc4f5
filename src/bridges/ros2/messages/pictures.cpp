#include "bridges/ros2/messages/pictures.h"

#include <algorithm>

#include <opencv2/imgproc.hpp>

#include "world/mesh/codecs.h"

namespace ruedo::ros2 {
namespace {

const char* encoding_of(int32_t format) {
  switch (format) {
    case image_t::PIXEL_FORMAT_GRAY: return "mono8";
    case image_t::PIXEL_FORMAT_BGR: return "bgr8";
    case image_t::PIXEL_FORMAT_LE_GRAY16: return "16UC1";
    case image_t::PIXEL_FORMAT_FLOAT_GRAY32: return "32FC1";
    default: return "rgb8";
  }
}

}  // namespace

RawPicture raw_picture(const image_t& image) {
  RawPicture raw;
  if (image.pixelformat != image_t::PIXEL_FORMAT_MJPEG) {
    raw.width = static_cast<uint32_t>(image.width);
    raw.height = static_cast<uint32_t>(image.height);
    raw.step = static_cast<uint32_t>(
        image.row_stride > 0 || image.height < 1 ? image.row_stride : image.size / image.height);
    raw.encoding = encoding_of(image.pixelformat);
    raw.data = image.data;
    return raw;
  }
  cv::Mat picture;
  if (!image.data.empty())
    picture = world::decode_picture(image.data.data(), image.data.size(), cv::IMREAD_UNCHANGED);
  if (picture.empty() || picture.depth() != CV_8U) return raw;
  if (picture.channels() == 3) cv::cvtColor(picture, picture, cv::COLOR_BGR2RGB);
  raw.width = static_cast<uint32_t>(picture.cols);
  raw.height = static_cast<uint32_t>(picture.rows);
  raw.step = raw.width * static_cast<uint32_t>(picture.channels());
  raw.encoding = picture.channels() == 3 ? "rgb8" : "mono8";
  raw.data.assign(picture.datastart, picture.dataend);
  return raw;
}

std::vector<uint8_t> jpeg_of(const image_t& image) {
  const bool grey = image.pixelformat == image_t::PIXEL_FORMAT_GRAY,
             rgb = image.pixelformat == image_t::PIXEL_FORMAT_RGB;
  const int type = grey ? CV_8UC1 : CV_8UC3;
  const size_t row = static_cast<size_t>(image.width) * CV_ELEM_SIZE(type);
  std::vector<uint8_t> packed;
  if (!grey && !rgb && image.pixelformat != image_t::PIXEL_FORMAT_BGR) return packed;
  const size_t stride = std::max(row, static_cast<size_t>(std::max(0, image.row_stride)));
  if (image.width < 1 || image.height < 1 ||
      image.data.size() < stride * static_cast<size_t>(image.height))
    return packed;
  cv::Mat picture(image.height, image.width, type, const_cast<uint8_t*>(image.data.data()), stride);
  if (rgb) cv::cvtColor(picture, picture, cv::COLOR_RGB2BGR);
  world::encode_picture(".jpg", picture, packed, {cv::IMWRITE_JPEG_QUALITY, 90});
  return packed;
}

}  // namespace ruedo::ros2
