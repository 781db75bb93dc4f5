// Common to cameras that show labels rather than light: optics, pose, and camera_info_t.
#pragma once

#include <memory>

#include "ruedo/camera_info_t.hpp"
#include "ruedo/device_info_t.hpp"
#include "scene/pictures/render_scene.h"
#include "sensors/camera_lens.h"
#include "sensors/mount.h"

namespace ruedo {

// Without utime.
camera_info_t camera_info(const Lens& lens);
void describe_lens(const Lens& lens, device_info_t& info);

// The <camera> of a sensor; throws InputError if there is none.
const Element& camera_of(const SensorSetup& setup);

// Reports children of <camera> that other cameras read and this one does not; `read`: those that it
// reads. Children that no camera reads were reported when the file was read.
void name_rest_of_camera(const SensorSetup& setup, const std::vector<std::string>& read);

// SensorKind::settings common to all cameras.
std::vector<std::string> camera_settings(const std::string& type);

class CameraView {
 public:
  // own: children of <camera> that the sensor reads itself.
  CameraView(const SensorSetup& setup, const std::vector<std::string>& own);

  const Lens& lens() const { return lens_; }
  Pose pose(const Snapshot& now) const { return mount_.pose(now); }  // x forward
  // Draws labels through the lens: index in BodyLayout::listed + 1, 0 for nothing.
  const cv::Mat& labels(const SampleInput& input);
  // The projection of a point in the camera's frame, in pixels; the point must be in front.
  Eigen::Vector2d seen_at(const Vec3& p_C) const;

  void publish_info(const SampleInput& input, Outbox& out);
  void describe(device_info_t& info) const { describe_lens(lens_, info); }

 private:
  Lens lens_;
  Mount mount_;
  std::shared_ptr<const LensMap> map_;
  scene::View view_;
  int info_channel_;
  camera_info_t info_;
  scene::Picture picture_;
  cv::Mat labels_;
};

}  // namespace ruedo
