// What the cameras share that show no light but what things are: optics, place, and camera_info_t.
#pragma once

#include <optional>

#include "ruedo/camera_info_t.hpp"
#include "ruedo/device_info_t.hpp"
#include "scene/render_scene.h"
#include "sensors/camera_lens.h"
#include "sensors/mount.h"

namespace ruedo {

// Of a lens; without utime.
camera_info_t camera_info(const Lens& lens);
void describe_lens(const Lens& lens, device_info_t& info);

// Finds the <camera> of a sensor; throws InputError where there is none.
const Element& camera_of(const SensorSetup& setup);

// Names what other cameras read of their <camera> and this one does not; `read`: what it does. What
// no camera reads, or no <camera> has, was named when the file was read.
void name_rest_of_camera(const SensorSetup& setup, const std::vector<std::string>& read);

// SensorKind::settings that every camera has.
std::vector<std::string> camera_settings(const std::string& type);

class CameraView {
 public:
  // own: children of <camera> that the sensor reads itself.
  CameraView(const SensorSetup& setup, const std::vector<std::string>& own);

  const Lens& lens() const { return lens_; }
  Pose pose(const Snapshot& now) const { return mount_.pose(now); }  // x ahead
  // Draws labels as the lens sees them: places in BodyLayout::listed + 1, 0 for nothing.
  const cv::Mat& labels(const SampleInput& input);
  // Where a point in the camera's frame is seen, in pixels; it has to be before the camera.
  Eigen::Vector2d seen_at(const Vec3& p_C) const;

  void publish_info(const SampleInput& input, Outbox& out);
  void describe(device_info_t& info) const { describe_lens(lens_, info); }

 private:
  Lens lens_;
  Mount mount_;
  std::optional<LensMap> map_;
  scene::View view_;
  int info_channel_;
  camera_info_t info_;
  scene::Picture picture_;
  cv::Mat labels_;
};

}  // namespace ruedo
