// A thermal camera: the temperature of each pixel's surface, on ROBOT/CAMERA; intrinsics on /info.
//
// Model: a body has the single temperature given by gz-sim's plugin Thermal; everything else and
// the sky have the air temperature at sea level (<atmosphere>). Emissivity is 1; there is no
// reflection, conduction or attenuation. A pixel is the temperature divided by <resolution> (0.01 K
// with 16 bits, 3 K with the format L8) of the plugin ThermalSensor, within its <min_temp> and
// <max_temp>, rounded; the camera's <noise> is in K.
#include <algorithm>

#include <fmt/format.h>

#include "base/whole.h"
#include "ruedo/image_t.hpp"
#include "sensors/camera_view.h"
#include "sensors/seen_things.h"
#include "world/compat/plugins.h"

namespace ruedo {
namespace {

class ThermalCamera : public Sensor {
 public:
  explicit ThermalCamera(const SensorSetup& setup)
      : random_(setup.random),
        air_(setup.world.environment.temperature),
        channel_(setup.channel<image_t>()),
        view_(setup, {"noise"}),
        things_(setup.world, setup.layout) {
    setup.element.refuse_unknown({"ruedo:phase"});
    const Element& camera = camera_of(setup);
    noise_ = Noise(camera.child("noise"));
    if (noise_.wanders() && setup.findings)
      setup.findings->unsupported(camera.child("noise")->source,
                                  "sensor " + setup.device + "/camera/noise",
                                  "<dynamic_bias_stddev> is not supported: pixels do not drift");
    if (!setup.noise) noise_ = Noise();
    RandomStream constants = random_.stream(kConstantDraws);
    noise_.draw_bias(constants);
    const std::string format = camera.string("image/format", "L16");
    bytes_ = format == "L8" || format == "L_INT8" ? 1 : 2;
    if (bytes_ == 2 && format != "L16" && format != "L_INT16" && setup.findings)
      setup.findings->unsupported(
          camera.child("image/format")->source, "sensor " + setup.device + "/camera/image/format",
          "the format '" + format + "' is not supported: the camera gives L16");
    read_range(setup.element);
    image_.nmetadata = 0;
    image_.width = view_.lens().width;
    image_.height = view_.lens().height;
    image_.pixelformat = bytes_ == 1 ? int32_t{image_t::PIXEL_FORMAT_GRAY}
                                     : int32_t{image_t::PIXEL_FORMAT_LE_GRAY16};
    image_.row_stride = image_.width * bytes_;
    image_.size = image_.row_stride * image_.height;
    image_.data.resize(static_cast<size_t>(image_.size));
  }

  void sample(const SampleInput& input, Outbox& out) override {
    things_.update();
    const cv::Mat& labels = view_.labels(input);
    RandomStream stream = random_.stream(static_cast<uint64_t>(input.sample));
    auto to = image_.data.begin();
    for (int row = 0; row < labels.rows; ++row) {
      const auto* pixels = labels.ptr<uint16_t>(row);
      for (int column = 0; column < labels.cols; ++column) {
        const double seen = things_[pixels[column]].temperature;
        const double kelvin = noise_.apply(seen > 0.0 ? seen : air_, 0.0, stream);
        const int value = counts(kelvin);
        *to++ = static_cast<uint8_t>(value & 0xff);
        if (bytes_ == 2) *to++ = static_cast<uint8_t>(value >> 8);
      }
    }
    image_.utime = input.snapshot.time;
    out.publish(channel_, image_);
    view_.publish_info(input, out);
  }

  void describe(device_info_t& info) const override { view_.describe(info); }

 private:
  void read_range(const Element& sensor) {
    const Allowed kelvin = Allowed::between(0.0, 10'000.0);
    static const Element kNothing;
    const Element* plugin = &kNothing;
    for (const Element* each : sensor.all("plugin")) {
      if (world::kind_of(*each).name == "ThermalSensor") plugin = each;
    }
    resolution_ = plugin->number("resolution", bytes_ == 1 ? 3.0 : 0.01,
                                 Allowed::positive(quantity::kFactor));
    const double most = resolution_ * (bytes_ == 1 ? 255 : 65535);
    lowest_ = plugin->number("min_temp", 0.0, kelvin);
    highest_ =
        std::min(plugin->number("max_temp", most, Allowed::positive(quantity::kRange)), most);
    if (highest_ <= lowest_)
      plugin->fail(
          fmt::format("max_temp has to be above min_temp, and min_temp below {} K, which is "
                      "the most that the format holds",
                      most));
  }

  int counts(double kelvin) const {
    return rounded<int>(std::clamp(kelvin, lowest_, highest_) / resolution_);
  }

  RandomSource random_;
  double air_;  // K
  int channel_;
  CameraView view_;
  SeenThings things_;
  Noise noise_;
  int bytes_ = 2;                                               // per pixel
  double resolution_ = 0.01, lowest_ = 0.0, highest_ = 655.35;  // K
  image_t image_;
};

const RegisterSensor kRegister{
    {.module = "camera",
     .order = 4,
     .types = {"thermal", "thermal_camera"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {30, 1},
     .needs_renderer = true,
     .make = [](const SensorSetup& setup) { return std::make_unique<ThermalCamera>(setup); },
     .kind = "thermal_camera",
     .settings = camera_settings}};

}  // namespace
}  // namespace ruedo
