// Label pictures through a lens.
#include "sensors/camera_view.h"

#include <algorithm>

#include "ruedo/math.h"

namespace ruedo {

camera_info_t camera_info(const Lens& lens) {
  camera_info_t info;
  info.utime = 0;
  info.width = lens.width;
  info.height = lens.height;
  info.fx = lens.fx;
  info.fy = lens.fy;
  info.cx = lens.cx;
  info.cy = lens.cy;
  std::copy(lens.distortion.begin(), lens.distortion.end(), info.distortion);
  info.near_clip = lens.near_m;
  info.far_clip = lens.far_m;
  return info;
}

void describe_lens(const Lens& lens, device_info_t& info) {
  info.width = lens.width;
  info.height = lens.height;
  info.fov_horizontal = lens.hfov;
  info.fov_vertical =
      math::atan((lens.cy + 0.5) / lens.fy) + math::atan((lens.height - 0.5 - lens.cy) / lens.fy);
  info.range_min = lens.near_m;
  info.range_max = lens.far_m;
}

const Element& camera_of(const SensorSetup& setup) {
  const Element* camera = setup.element.child("camera");
  if (!camera) setup.element.fail("a camera needs a <camera> element");
  return *camera;
}

void name_rest_of_camera(const SensorSetup& setup, const std::vector<std::string>& read) {
  for (const char* name :
       {"noise", "distortion", "depth_camera", "box_type", "segmentation_type"}) {
    if (std::find(read.begin(), read.end(), name) == read.end())
      name_where_written(setup, camera_of(setup), {name});
  }
}

std::vector<std::string> camera_settings(const std::string&) {
  return {"camera.horizontal_fov", "camera.image.width", "camera.image.height",
          "camera.image.format",   "camera.clip.near",   "camera.clip.far"};
}

CameraView::CameraView(const SensorSetup& setup, const std::vector<std::string>& own)
    : lens_(camera_of(setup)),
      mount_(setup, camera_of(setup).pose("pose")),
      info_channel_(setup.channel<camera_info_t>("info")),
      info_(camera_info(lens_)) {
  std::vector<std::string> read = own;
  read.push_back("distortion");
  name_rest_of_camera(setup, read);
  if (lens_.distorts()) map_ = LensMap::of(lens_, camera_of(setup), setup.world);
  view_ =
      map_ ? map_->ideal() : scene::View{{},       lens_.width, lens_.height, lens_.fx,   lens_.fy,
                                         lens_.cx, lens_.cy,    lens_.near_m, lens_.far_m};
  picture_.want_rgb = false;
  picture_.want_labels = true;
}

const cv::Mat& CameraView::labels(const SampleInput& input) {
  view_.X_WCamera = mount_.pose(input.snapshot);
  input.renderer->draw(input.snapshot, view_, picture_);
  const cv::Mat drawn(view_.height, view_.width, CV_16U, picture_.labels.data());
  if (map_)
    map_->pick(drawn, labels_, 0.0);
  else
    drawn.copyTo(labels_);
  return labels_;
}

Eigen::Vector2d CameraView::seen_at(const Vec3& p_C) const {
  const Eigen::Vector2d ideal(-p_C.y() / p_C.x(), -p_C.z() / p_C.x());
  const Eigen::Vector2d bent = lens_.distorts() ? lens_.distort(ideal) : ideal;
  return {lens_.cx + lens_.fx * bent.x(), lens_.cy + lens_.fy * bent.y()};
}

void CameraView::publish_info(const SampleInput& input, Outbox& out) {
  info_.utime = input.snapshot.time;
  out.publish(info_channel_, info_);
}

}  // namespace ruedo
