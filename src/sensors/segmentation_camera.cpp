// A segmentation camera: the class of what each pixel shows, on ROBOT/CAMERA; intrinsics on /info.
// Classes are those of gz-sim's plugin Label; 0 is unlabelled.
//
// <segmentation_type> semantic: 8 bits, the class. instance, panoptic: 16 bits, 256 times the class
// plus the model's number in its class, from 1 (at most 255).
#include <algorithm>

#include "ruedo/image_t.hpp"
#include "sensors/camera_view.h"
#include "sensors/seen_things.h"

namespace ruedo {
namespace {

class SegmentationCamera : public Sensor {
 public:
  explicit SegmentationCamera(const SensorSetup& setup)
      : channel_(setup.channel<image_t>()),
        view_(setup, {"segmentation_type"}),
        things_(setup.world, setup.layout) {
    setup.element.refuse_unknown({"ruedo:phase"});
    // In older files it is beside <camera>.
    const char* const path = setup.element.has("camera/segmentation_type")
                                 ? "camera/segmentation_type"
                                 : "segmentation_type";
    const std::string type =
        setup.element.choice(path, "semantic", {"semantic", "instance", "panoptic"});
    instances_ = type != "semantic";
    image_.nmetadata = 0;
    image_.width = view_.lens().width;
    image_.height = view_.lens().height;
    image_.pixelformat =
        instances_ ? int32_t{image_t::PIXEL_FORMAT_LE_GRAY16} : int32_t{image_t::PIXEL_FORMAT_GRAY};
    image_.row_stride = image_.width * (instances_ ? 2 : 1);
    image_.size = image_.row_stride * image_.height;
    image_.data.resize(static_cast<size_t>(image_.size));
  }

  void sample(const SampleInput& input, Outbox& out) override {
    things_.update();
    const cv::Mat& labels = view_.labels(input);
    auto to = image_.data.begin();
    for (int row = 0; row < labels.rows; ++row) {
      const auto* pixels = labels.ptr<uint16_t>(row);
      for (int column = 0; column < labels.cols; ++column) {
        const SeenThings::Thing& thing = things_[pixels[column]];
        if (instances_) *to++ = static_cast<uint8_t>(std::min(thing.number, 255));
        *to++ = static_cast<uint8_t>(thing.label);
      }
    }
    image_.utime = input.snapshot.time;
    out.publish(channel_, image_);
    view_.publish_info(input, out);
  }

  void describe(device_info_t& info) const override { view_.describe(info); }

 private:
  int channel_;
  CameraView view_;
  SeenThings things_;
  bool instances_ = false;
  image_t image_;
};

const RegisterSensor kRegister{
    {.module = "camera",
     .order = 4,
     .types = {"segmentation", "segmentation_camera"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {30, 1},
     .needs_renderer = true,
     .make = [](const SensorSetup& setup) { return std::make_unique<SegmentationCamera>(setup); },
     .kind = "segmentation_camera",
     .settings = camera_settings}};

}  // namespace
}  // namespace ruedo
