// Cameras: colour or grey pictures on ROBOT/CAMERA, depth on /depth, labels on /labels, intrinsics
// on /info.
//
// A pinhole camera with square pixels, fx = width / (2 tan(hfov / 2)), distorted by its lens
// (camera_lens.h), with vignetting and noise in each pixel (pixel_noise.h). Depth is along the
// optical axis and has neither. Pictures are drawn from visuals by the renderer that the module
// provides.
#include "ruedo/camera_info_t.hpp"
#include "ruedo/device_info_t.hpp"
#include "ruedo/image_t.hpp"
#include "ruedo/math.h"
#include "ruedo/sensor.h"

#include <optional>

#include <opencv2/imgproc.hpp>

#include "scene/pictures/render_scene.h"
#include "sensors/camera_lens.h"
#include "sensors/camera_view.h"
#include "sensors/jpeg.h"
#include "sensors/pixel_noise.h"
#include "world/model/body_layout.h"

namespace ruedo {
namespace {

enum class Encoding { jpeg, rgb, grey };

bool wants_depth(const std::string& type) {
  return type == "depth" || type == "depth_camera" || type == "rgbd" || type == "rgbd_camera";
}

class Camera : public Sensor {
 public:
  explicit Camera(const SensorSetup& setup)
      : random_(setup.random),
        lens_(camera_of(setup)),
        noise_(0, 0),
        vignette_(0, 0, 0),
        channel_(setup.channel<image_t>()),
        info_channel_(setup.channel<camera_info_t>("info")) {
    const Element& element = setup.element;
    const Element& camera = camera_of(setup);
    element.refuse_unknown({"ruedo:encoding", "ruedo:quality", "ruedo:depth", "ruedo:labels",
                            "ruedo:exposure", "ruedo:vignetting", "ruedo:phase"});
    const world::LinkPlacement& link = setup.layout.links[setup.link];
    body_ = link.body;
    X_LC_ = setup.X_LS * camera.pose("pose");
    X_BC_ = link.X_BL * X_LC_;
    layout_ = &setup.layout;
    link_ = setup.link;
    read_noise(camera, setup);
    vignette_ = Vignette(element.number("ruedo:vignetting", 0.0, Allowed::between(0.0, 1.0)),
                         lens_.width, lens_.height);
    const std::string* type = element.attribute("type");
    const bool depth = element.boolean("ruedo:depth", type && wants_depth(*type));
    if (depth) depth_channel_ = setup.channel<image_t>("depth");
    const bool labels = element.boolean("ruedo:labels", false);
    if (labels) labels_channel_ = setup.channel<image_t>("labels");
    read_format(camera, setup);
    picture_.want_depth = depth;
    picture_.want_labels = labels;

    if (lens_.distorts()) map_ = LensMap::of(lens_, camera, setup.world);
    if (map_) {
      view_ = map_->ideal();
    } else {
      view_ = scene::View{{},       lens_.width, lens_.height, lens_.fx,   lens_.fy,
                          lens_.cx, lens_.cy,    lens_.near_m, lens_.far_m};
    }
    view_.exposure =
        math::exp2(element.number("ruedo:exposure", 0.0, Allowed::between(-10.0, 10.0)));
    view_.samples = camera.integer("image/anti_aliasing", 1, Allowed::between(0, 1e9)) > 1 ? 4 : 1;
    fill_info();
  }

  void sample(const SampleInput& input, Outbox& out) override {
    view_.X_WCamera = X_WC(input.snapshot);
    input.renderer->draw(input.snapshot, view_, picture_);
    publish_picture(input, out);
    if (depth_channel_)
      publish_plane(input, out, *depth_channel_, image_t::PIXEL_FORMAT_FLOAT_GRAY32, CV_32F,
                    picture_.depth.data());
    if (labels_channel_)
      publish_plane(input, out, *labels_channel_, image_t::PIXEL_FORMAT_LE_GRAY16, CV_16U,
                    picture_.labels.data());
    info_.utime = input.snapshot.time;
    out.publish(info_channel_, info_);
  }

  void describe(device_info_t& info) const override { describe_lens(lens_, info); }

 private:
  Pose X_WC(const Snapshot& now) const {
    if (!body_.valid()) return X_BC_;
    const Pose& X_WB = now.bodies[body_];
    const bool on_wheel = layout_->links[link_].wheel.valid();
    return on_wheel ? X_WB * layout_->link_in_body(link_, now.wheel_angles) * X_LC_ : X_WB * X_BC_;
  }

  void read_format(const Element& camera, const SensorSetup& setup) {
    const std::string encoding =
        setup.element.choice("ruedo:encoding", "jpeg", {"jpeg", "rgb", "grey"});
    encoding_ = encoding == "jpeg"  ? Encoding::jpeg
                : encoding == "rgb" ? Encoding::rgb
                                    : Encoding::grey;
    quality_ = static_cast<int>(
        setup.element.integer("ruedo:quality", 85, Allowed::between(kLeastJpegQuality, 100)));
    const std::string format = camera.string("image/format", "R8G8B8");
    grey_ = encoding_ == Encoding::grey || format == "L8" || format == "L_INT8";
    const bool colour =
        format == "R8G8B8" || format == "RGB_INT8" || format == "B8G8R8" || format == "BGR_INT8";
    const bool depth = depth_channel_ &&
                       // depth is published in addition
                       (format == "R_FLOAT32" || format == "FLOAT32");
    if (!grey_ && !colour && !depth && setup.findings) {
      setup.findings->unsupported(
          camera.child("image/format")->source, "sensor " + setup.device + "/camera/image/format",
          "the format '" + format + "' is not supported: the camera gives R8G8B8");
    }
    if (const Element* lens = camera.child("lens/type");
        lens && lens->text != "gnomonical" && lens->text != "custom" && setup.findings) {
      setup.findings->unsupported(
          lens->source, "sensor " + setup.device + "/camera/lens/type",
          "the projection '" + lens->text + "' is not supported: the camera is a pinhole");
    }
  }

  void read_noise(const Element& camera, const SensorSetup& setup) {
    const Element* noise = camera.child("noise");
    if (!noise) return;
    const std::string* attribute = noise->attribute("type");
    const std::string type = attribute ? *attribute : noise->string("type", "none");
    if (type != "none" && type != "gaussian")
      noise->fail("type '" + type + "' is not allowed; allowed: none, gaussian");
    const double mean = noise->number("mean", 0.0, Allowed::any(quantity::kNoise)),
                 stddev = noise->number("stddev", 0.0, Allowed::not_negative(quantity::kNoise));
    if (setup.noise && type == "gaussian") noise_ = PixelNoise(mean, stddev);
  }

  void fill_info() {
    info_ = camera_info(lens_);
    image_.nmetadata = plane_.nmetadata = 0;
    image_.width = plane_.width = lens_.width;
    image_.height = plane_.height = lens_.height;
  }

  void publish_picture(const SampleInput& input, Outbox& out) {
    cv::Mat pixels(view_.height, view_.width, CV_8UC3, picture_.rgb.data());
    if (map_) {
      map_->blend(pixels, bent_);
      pixels = bent_;
    }
    if (grey_) {
      cv::cvtColor(pixels, grey_picture_, cv::COLOR_RGB2GRAY);
      pixels = grey_picture_;
    }
    const std::span<uint8_t> bytes(pixels.data, pixels.total() * pixels.elemSize());
    vignette_.apply(bytes, pixels.channels());
    noise_.apply(random_.stream(static_cast<uint64_t>(input.sample)), bytes);

    image_.utime = input.snapshot.time;
    if (encoding_ == Encoding::jpeg) {
      write_jpeg(pixels);
    } else {
      image_.data.assign(bytes.begin(), bytes.end());
      image_.row_stride = static_cast<int32_t>(lens_.width * pixels.channels());
      image_.pixelformat =
          grey_ ? int32_t{image_t::PIXEL_FORMAT_GRAY} : int32_t{image_t::PIXEL_FORMAT_RGB};
    }
    image_.size = static_cast<int32_t>(image_.data.size());
    out.publish(channel_, image_);
  }

  void write_jpeg(const cv::Mat& pixels) {
    const cv::Mat* source = &pixels;
    if (!grey_) {
      cv::cvtColor(pixels, bgr_, cv::COLOR_RGB2BGR);  // OpenCV's order
      source = &bgr_;
    }
    encode_jpeg(*source, quality_, image_.data);
    image_.row_stride = 0;
    image_.pixelformat = image_t::PIXEL_FORMAT_MJPEG;
  }

  void publish_plane(const SampleInput& input, Outbox& out, int channel, int32_t format,
                     int cv_type, void* values) {
    cv::Mat pixels(view_.height, view_.width, cv_type, values);
    if (map_) {
      map_->pick(pixels, bent_plane_,
                 cv_type == CV_32F ? std::numeric_limits<double>::infinity() : 0.0);
      pixels = bent_plane_;
    }
    plane_.utime = input.snapshot.time;
    plane_.pixelformat = format;
    plane_.row_stride = static_cast<int32_t>(static_cast<size_t>(lens_.width) * pixels.elemSize());
    plane_.data.assign(pixels.data, pixels.data + pixels.total() * pixels.elemSize());
    plane_.size = static_cast<int32_t>(plane_.data.size());
    out.publish(channel, plane_);
  }

  RandomSource random_;
  Lens lens_;
  PixelNoise noise_;
  Vignette vignette_;
  int channel_, info_channel_;
  std::optional<int> depth_channel_, labels_channel_;
  BodyIndex body_;  // none: static
  Pose X_BC_;       // X_WC if static
  const world::BodyLayout* layout_ = nullptr;
  LinkIndex link_;
  Pose X_LC_;
  Encoding encoding_ = Encoding::jpeg;
  bool grey_ = false;
  int quality_ = 85;
  std::shared_ptr<const LensMap> map_;
  scene::View view_;

  // Kept between samples to avoid allocations.
  scene::Picture picture_;
  cv::Mat bent_, bent_plane_, grey_picture_, bgr_;
  image_t image_, plane_;
  camera_info_t info_;
};

std::vector<std::string> settings_of(const std::string& type) {
  std::vector<std::string> keys = camera_settings(type);
  for (std::string& key : noise_settings("camera.noise")) keys.push_back(std::move(key));
  for (const char* each : {"encoding", "quality", "depth", "labels", "exposure", "vignetting"})
    keys.push_back(std::string("ruedo:") + each);
  return keys;
}

const RegisterSensor kRegister{
    {.module = "camera",
     .order = 4,
     .types = {"camera", "depth", "depth_camera", "rgbd", "rgbd_camera"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {30, 1},
     .needs_renderer = true,
     .make = [](const SensorSetup& setup) { return std::make_unique<Camera>(setup); },
     .settings = settings_of}};

}  // namespace
}  // namespace ruedo
