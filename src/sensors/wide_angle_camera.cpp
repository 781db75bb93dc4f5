// A wide-angle camera (fisheye): SDF's <lens> on ROBOT/CAMERA.
//
// A ray at the angle theta from the axis appears at the radius r = c1 f fun(theta / c2 + c3) from
// the centre, with fun and the constants given by <type>: gnomonical tan, stereographic 2 tan(theta
// / 2), equidistant theta, equisolid_angle 2 sin(theta / 2), orthographic sin, or
// <custom_function>. With <scale_to_hfov>, f is such that <horizontal_fov> fills the width. Nothing
// is visible beyond <cutoff_angle> (pi / 2). Each picture is assembled from those of a cube around
// the camera, so that up to 2 pi are visible; pixels are interpolated between their four
// neighbours. Lighting as for cameras.
#include <cmath>
#include <optional>

#include <opencv2/imgproc.hpp>

#include <fmt/format.h>

#include "base/message_size.h"
#include "ruedo/image_t.hpp"
#include "ruedo/math.h"
#include "sensors/camera_view.h"
#include "sensors/jpeg.h"
#include "sensors/pixel_noise.h"

namespace ruedo {
namespace {

constexpr int kQuality = 85;

// From <lens>: angle to radius, and the inverse by bisection, since fun is increasing up to the
// cutoff.
class Projection {
 public:
  Projection(const Element& camera, double hfov) {
    const std::string type = camera.choice("lens/type", "stereographic",
                                           {"gnomonical", "stereographic", "equidistant",
                                            "equisolid_angle", "orthographic", "custom"});
    if (type == "gnomonical") set("tan", 1, 1);
    if (type == "stereographic") set("tan", 2, 2);
    if (type == "equidistant") set("id", 1, 1);
    if (type == "equisolid_angle") set("sin", 2, 2);
    if (type == "orthographic") set("sin", 1, 1);
    if (type == "custom") {
      const std::string own = "lens/custom_function/";
      const Allowed any = Allowed::any(quantity::kFactor);
      set(camera.choice(own + "fun", "tan", {"sin", "tan", "id"}),
          camera.number(own + "c1", 1, Allowed::positive(quantity::kFactor)),
          camera.number(own + "c2", 1, Allowed::positive(quantity::kFactor)));
      c3_ = camera.number(own + "c3", 0, any);
      f_ = camera.number(own + "f", 1, Allowed::positive(quantity::kFactor));
    }
    cutoff_ = camera.number("lens/cutoff_angle", M_PI / 2,
                            Allowed{.min = 0, .max = M_PI, .min_excluded = true});
    const bool scaled = camera.boolean("lens/scale_to_hfov", true);
    const double edge = hfov / 2;
    if (!grows_to(std::min(cutoff_, std::max(edge, 1e-3))))
      camera.fail(
          fmt::format("the projection of its <lens> does not grow up to {} rad from the "
                      "axis: <horizontal_fov> is too wide for it",
                      edge));
    while (!grows_to(cutoff_)) cutoff_ -= 1e-3;
    if (scaled) f_ = 1.0 / (radius(edge) / f_);  // half the width is 1
  }

  double radius(double theta) const { return c1_ * f_ * fun(theta / c2_ + c3_); }

  // The angle for a radius; empty beyond the cutoff.
  std::optional<double> angle(double r) const {
    if (r > radius(cutoff_)) return std::nullopt;
    double low = 0, high = cutoff_;
    for (int i = 0; i < 45; ++i) {
      const double middle = (low + high) / 2;
      (radius(middle) < r ? low : high) = middle;
    }
    return (low + high) / 2;
  }

 private:
  void set(const std::string& fun, double c1, double c2) {
    fun_ = fun == "tan" ? ruedo_tan : fun == "sin" ? ruedo_sin : identity;
    c1_ = c1;
    c2_ = c2;
  }
  static double identity(double x) { return x; }
  double fun(double x) const { return fun_(x); }

  bool grows_to(double theta) const {
    double last = radius(0);
    if (!(last >= 0)) return false;
    for (int i = 1; i <= 1000; ++i) {
      const double next = radius(theta * i / 1000);
      if (!(next > last) || !(next < 1e6)) return false;
      last = next;
    }
    return true;
  }

  double (*fun_)(double) = identity;
  double c1_ = 1, c2_ = 1, c3_ = 0, f_ = 1, cutoff_ = M_PI / 2;
};

// The faces of the cube: the orientation of each in the camera's frame.
const Quat kFaces[] = {
    Quat::Identity(),                                   // ahead
    Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ())),   // left
    Quat(Eigen::AngleAxisd(-M_PI / 2, Vec3::UnitZ())),  // right
    Quat(Eigen::AngleAxisd(-M_PI / 2, Vec3::UnitY())),  // up
    Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitY())),   // down
    Quat(Eigen::AngleAxisd(M_PI, Vec3::UnitZ())),       // back
};
constexpr int kMargin = 2;  // pixels of the neighbouring faces around each face, for interpolation

class WideAngleCamera : public Sensor {
 public:
  explicit WideAngleCamera(const SensorSetup& setup)
      : random_(setup.random), noise_(0, 0), channel_(setup.channel<image_t>()) {
    const Element& camera = camera_of(setup);
    setup.element.refuse_unknown({"ruedo:encoding", "ruedo:quality", "ruedo:phase"});
    name_rest_of_camera(setup, {"noise"});
    if (const Element* lens = camera.child("lens"))
      name_where_written(setup, *lens, {"intrinsics"});
    read_picture(camera, setup);
    const Projection projection(camera, hfov_);
    make_map(projection, static_cast<int>(camera.integer("lens/env_texture_size", 256,
                                                         Allowed::between(4, 2048))));
    mount_.emplace(setup, camera.pose("pose"));
    image_.nmetadata = 0;
    image_.width = width_;
    image_.height = height_;
  }

  void sample(const SampleInput& input, Outbox& out) override {
    const Pose X_WC = mount_->pose(input.snapshot);
    for (const int face : used_) {
      view_.X_WCamera = X_WC * Pose{kFaces[face], Vec3::Zero()};
      input.renderer->draw(input.snapshot, view_, picture_);
      cv::Mat drawn(view_.height, view_.width, CV_8UC3, picture_.rgb.data());
      drawn.copyTo(atlas_(cv::Rect(0, face * view_.height, view_.width, view_.height)));
    }
    cv::remap(atlas_, bent_, at_, cv::Mat(), cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar());
    const std::span<uint8_t> bytes(bent_.data, bent_.total() * bent_.elemSize());
    noise_.apply(random_.stream(static_cast<uint64_t>(input.sample)), bytes);
    image_.utime = input.snapshot.time;
    if (raw_) {
      image_.pixelformat = image_t::PIXEL_FORMAT_RGB;
      image_.row_stride = 3 * width_;
      image_.data.assign(bytes.begin(), bytes.end());
    } else {
      write_jpeg();
    }
    image_.size = static_cast<int32_t>(image_.data.size());
    out.publish(channel_, image_);
  }

  void describe(device_info_t& info) const override {
    info.width = width_;
    info.height = height_;
    info.fov_horizontal = hfov_;
    info.range_min = view_.near_m;
    info.range_max = view_.far_m;
  }

 private:
  void read_picture(const Element& camera, const SensorSetup& setup) {
    width_ = static_cast<int>(camera.integer("image/width", 320, Allowed::between(1, kMostPixels)));
    height_ =
        static_cast<int>(camera.integer("image/height", 240, Allowed::between(1, kMostPixels)));
    hfov_ = camera.number("horizontal_fov", 1.047,
                          Allowed{.min = 0, .max = 2 * M_PI, .min_excluded = true});
    view_.near_m = camera.number("clip/near", 0.1, Allowed::positive(quantity::kRange));
    view_.far_m = camera.number("clip/far", 100.0, Allowed::positive(quantity::kRange));
    if (view_.far_m <= view_.near_m) camera.fail("the far clip has to be beyond the near one");
    raw_ = setup.element.choice("ruedo:encoding", "jpeg", {"jpeg", "rgb"}) == "rgb";
    quality_ = static_cast<int>(
        setup.element.integer("ruedo:quality", kQuality, Allowed::between(kLeastJpegQuality, 100)));
    if (const Element* noise = camera.child("noise")) {
      const std::string* attribute = noise->attribute("type");
      const std::string type = attribute ? *attribute : noise->string("type", "none");
      if (type != "none" && type != "gaussian")
        noise->fail("type '" + type + "' is not allowed; allowed: none, gaussian");
      if (setup.noise && type == "gaussian")
        noise_ = PixelNoise(noise->number("mean", 0.0, Allowed::any(quantity::kNoise)),
                            noise->number("stddev", 0.0, Allowed::not_negative(quantity::kNoise)));
    }
    if (const Element* format = camera.child("image/format");
        format && format->text != "R8G8B8" && format->text != "RGB_INT8" && setup.findings)
      setup.findings->unsupported(
          format->source, "sensor " + setup.device + "/camera/image/format",
          "the format '" + format->text + "' is not supported: the camera gives R8G8B8");
  }

  // The position of each pixel on the faces, which are stacked vertically.
  void make_map(const Projection& projection, int face_pixels) {
    view_.width = view_.height = face_pixels + 2 * kMargin;
    view_.fx = view_.fy = face_pixels / 2.0;  // 90 degrees, without the margin
    view_.cx = view_.cy = (view_.width - 1) / 2.0;
    atlas_ =
        cv::Mat::zeros(view_.height * static_cast<int>(std::size(kFaces)), view_.width, CV_8UC3);
    at_.create(height_, width_, CV_32FC2);
    bool used[std::size(kFaces)] = {};
    for (int row = 0; row < height_; ++row) {
      for (int column = 0; column < width_; ++column) {
        const double right = (column - width_ / 2.0) / (width_ / 2.0),
                     down = (row - height_ / 2.0) / (width_ / 2.0);
        at_.at<cv::Vec2f>(row, column) = place(projection, right, down, used);
      }
    }
    for (int face = 0; face < static_cast<int>(std::size(kFaces)); ++face) {
      if (used[face]) used_.push_back(face);
    }
  }

  cv::Vec2f place(const Projection& projection, double right, double down, bool* used) const {
    const cv::Vec2f nowhere(-10, -10);
    const double r = math::hypot(right, down);
    const std::optional<double> theta = projection.angle(r);
    if (!theta) return nowhere;
    const double s = r > 0 ? math::sin(*theta) / r : 0;
    const Vec3 ray(math::cos(*theta), -s * right, -s * down);
    int face = 0;
    double most = -1;
    for (int i = 0; i < static_cast<int>(std::size(kFaces)); ++i) {
      const double ahead = (kFaces[i] * Vec3::UnitX()).dot(ray);
      if (ahead > most) face = i, most = ahead;
    }
    used[face] = true;
    const Vec3 on = kFaces[face].conjugate() * ray;
    return {static_cast<float>(view_.cx - view_.fx * on.y() / on.x()),
            static_cast<float>(view_.cy - view_.fy * on.z() / on.x() + face * view_.height)};
  }

  void write_jpeg() {
    cv::cvtColor(bent_, bgr_, cv::COLOR_RGB2BGR);
    encode_jpeg(bgr_, quality_, image_.data);
    image_.row_stride = 0;
    image_.pixelformat = image_t::PIXEL_FORMAT_MJPEG;
  }

  RandomSource random_;
  PixelNoise noise_;
  int channel_;
  std::optional<Mount> mount_;
  int width_ = 320, height_ = 240;
  double hfov_ = 1.047;
  bool raw_ = false;
  int quality_ = kQuality;
  scene::View view_;       // of a face
  std::vector<int> used_;  // visible faces
  scene::Picture picture_;
  cv::Mat atlas_, at_, bent_, bgr_;
  image_t image_;
};

std::vector<std::string> settings_of(const std::string& type) {
  std::vector<std::string> keys = camera_settings(type);
  for (const char* each : {"encoding", "quality"}) keys.push_back(std::string("ruedo:") + each);
  return keys;
}

const RegisterSensor kRegister{
    {.module = "camera",
     .order = 4,
     .types = {"wideanglecamera", "wide_angle_camera"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {30, 1},
     .needs_renderer = true,
     .make = [](const SensorSetup& setup) { return std::make_unique<WideAngleCamera>(setup); },
     .kind = "wide_angle_camera",
     .settings = settings_of}};

}  // namespace
}  // namespace ruedo
