// Cameras against geometry, optics and statistics: a fiducial marker's pose, a wall's depth, a
// lens's bending, the distribution of the noise.
#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#ifdef RUEDO_ARUCO
#include <opencv2/calib3d.hpp>
#if __has_include(<opencv2/objdetect/aruco_detector.hpp>)  // from 4.7 on
#define RUEDO_ARUCO_DETECTOR
#include <opencv2/objdetect/aruco_detector.hpp>
#else
#include <opencv2/aruco.hpp>
#endif
#endif

#include "ruedo/camera_info_t.hpp"
#include "ruedo/device_info_t.hpp"
#include "ruedo/image_t.hpp"
#include "scene/pictures/render_scene.h"
#include "sensor_bench.h"
#include "sensors/camera_lens.h"
#include "sensors/pixel_noise.h"
#include "world/document/document.h"

namespace ruedo {
namespace {

using test::Device;
using test::SensorBench;

// A camera at (0, 0, 1) looking along x at `things`. <camera> and <sensor> take more elements.
std::string world_with(const std::string& things, const std::string& in_camera = "",
                       const std::string& in_sensor = "", const std::string& type = "camera") {
  return R"(<?xml version="1.0"?><sdf version="1.9"><world name="w">
    <light name="sun" type="directional"><direction>0.6 0.2 -0.5</direction><diffuse>0.8 0.8 0.8 1</diffuse></light>
    )" + things +
         R"(
    <model name="eye"><static>true</static><pose>0 0 1 0 0 0</pose><link name="link">
      <sensor name="camera" type=")" +
         type + R"("><update_rate>10</update_rate>)" + in_sensor + R"(
        <camera><horizontal_fov>1.2</horizontal_fov><image><width>640</width><height>480</height></image>
        <clip><near>0.05</near><far>50</far></clip>)" +
         in_camera + R"(</camera>
      </sensor></link></model></world></sdf>)";
}

std::string box(const std::string& name, const std::string& pose, const std::string& size,
                const std::string& material) {
  return "<model name='" + name + "'><static>true</static><pose>" + pose +
         "</pose><link name='link'><visual name='v'><geometry><box><size>" + size +
         "</size></box></geometry><material>" + material + "</material></visual></link></model>";
}

const std::string kWall =
    box("wall", "3.5 0 1 0 0 0", "1 40 40", "<diffuse>0.5 0.5 0.5 1</diffuse>");
const std::string kRaw = "<ruedo:encoding>rgb</ruedo:encoding>";

// A camera with what it published for one sample.
struct Shot {
  explicit Shot(const std::string& sdf, SensorBench::Options options = {}, int64_t sample = 0)
      : bench(sdf),
        device(bench.make("eye", "camera", options)),
        renderer(scene::make_renderer(*bench.world, bench.layout)) {
    take(sample);
  }
  void take(int64_t sample) {
    out.clear();
    const Snapshot snapshot = bench.snapshot();
    device.sensor->sample({snapshot, sample, nullptr, renderer.get()}, out);
  }
  int channel(const std::string& suffix) const {
    for (size_t i = 0; i < device.channels.size(); ++i) {
      if (device.channels[i] == "eye/camera" + suffix) return static_cast<int>(i);
    }
    return -1;
  }
  image_t image(const std::string& suffix = "") const {
    return Device::decode<image_t>(out, channel(suffix)).at(0);
  }
  camera_info_t info() const { return Device::decode<camera_info_t>(out, channel("/info")).at(0); }
  // Bytes of channel c at (u, v) of a raw picture.
  static int value(const image_t& image, int u, int v, int c = 0) {
    return image.data[v * image.row_stride + u * (image.row_stride / image.width) + c];
  }
  float depth(int u, int v) const {
    const image_t image = this->image("/depth");
    float metres;
    std::memcpy(&metres, &image.data[v * image.row_stride + 4 * u], 4);
    return metres;
  }

  SensorBench bench;
  Device device;
  std::unique_ptr<scene::Renderer> renderer;
  Outbox out;
};

#ifdef RUEDO_ARUCO
#ifdef RUEDO_ARUCO_DETECTOR
void draw_marker(int id, int pixels, cv::Mat& picture) {
  cv::aruco::generateImageMarker(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50), id,
                                 pixels, picture);
}
void find_markers(const cv::Mat& picture, std::vector<std::vector<cv::Point2f>>& corners,
                  std::vector<int>& ids) {
  cv::aruco::ArucoDetector(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50))
      .detectMarkers(picture, corners, ids);
}
#else
void draw_marker(int id, int pixels, cv::Mat& picture) {
  cv::aruco::drawMarker(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50), id, pixels,
                        picture);
}
void find_markers(const cv::Mat& picture, std::vector<std::vector<cv::Point2f>>& corners,
                  std::vector<int>& ids) {
  cv::aruco::detectMarkers(picture, cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50),
                           corners, ids);
}
#endif

TEST(Camera, AMarkersPoseComesBack) {
  // A marker of 0.3 m with a white margin of a sixth, on a board that is turned a little.
  cv::Mat marker, board;
  draw_marker(7, 600, marker);
  cv::copyMakeBorder(marker, board, 100, 100, 100, 100, cv::BORDER_CONSTANT, 255);
  ASSERT_TRUE(cv::imwrite(testing::TempDir() + "/marker.png", board));
  const std::string poster =
      "<diffuse>1 1 1 1</diffuse><pbr><metal><albedo_map>marker.png</albedo_map></metal></pbr>";
  for (const std::string& distortion :
       {std::string(),
        std::string("<distortion><k1>-0.2</k1><k2>0.05</k2><p1>0.001</p1></distortion>")}) {
    Shot shot(world_with(box("board", "2 0.3 1.1 0 0.2 0.3", "0.01 0.4 0.4", poster), distortion));
    const image_t image = shot.image();
    const cv::Mat picture = cv::imdecode(image.data, cv::IMREAD_COLOR);
    const camera_info_t info = shot.info();
    const cv::Mat K = (cv::Mat_<double>(3, 3) << info.fx, 0, info.cx, 0, info.fy, info.cy, 0, 0, 1);
    const cv::Mat D(1, 5, CV_64F, const_cast<double*>(info.distortion));
    std::vector<int> ids;
    std::vector<std::vector<cv::Point2f>> corners;
    find_markers(picture, corners, ids);
    ASSERT_EQ(ids, std::vector<int>{7});
    cv::cornerSubPix(
        [&] {
          cv::Mat grey;
          cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
          return grey;
        }(),
        corners[0], cv::Size(3, 3), cv::Size(-1, -1),
        cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.01));
    // The marker's own frame: x to its right, y up, from its middle; corners from the upper left
    // one, clockwise.
    const std::vector<cv::Point3d> square{
        {-0.15, 0.15, 0}, {0.15, 0.15, 0}, {0.15, -0.15, 0}, {-0.15, -0.15, 0}};
    cv::Vec3d rotation, translation;
    ASSERT_TRUE(cv::solvePnP(square, corners[0], K, D, rotation, translation));
    // The near face's middle, 5 mm before the board's: in the optical frame x right, y down, z
    // ahead.
    const Pose X_WBoard = Pose::from_xyz_rpy({2, 0.3, 1.1}, {0, 0.2, 0.3});
    const Vec3 p = X_WBoard * Vec3(-0.005, 0, 0) - Vec3(0, 0, 1);
    EXPECT_NEAR(translation[0], -p.y(), 0.01);
    EXPECT_NEAR(translation[1], -p.z(), 0.01);
    EXPECT_NEAR(translation[2], p.x(), 0.01);
    // The marker's z axis leaves the board towards the camera.
    cv::Mat R;
    cv::Rodrigues(rotation, R);
    const Vec3 normal = X_WBoard.rotation * -Vec3::UnitX();
    EXPECT_NEAR(R.at<double>(0, 2), -normal.y(), 0.06);
    EXPECT_NEAR(R.at<double>(1, 2), -normal.z(), 0.06);
    EXPECT_NEAR(R.at<double>(2, 2), normal.x(), 0.06);
  }
}
#else
TEST(Camera, AMarkersPoseComesBack) {
  GTEST_SKIP() << "OpenCV's aruco (libopencv-contrib-dev) is not installed";
}
#endif

TEST(Camera, IntrinsicsOfAPinhole) {
  Shot shot(world_with(kWall));
  const camera_info_t info = shot.info();
  EXPECT_EQ(info.width, 640);
  EXPECT_EQ(info.height, 480);
  EXPECT_NEAR(info.fx, 320.0 / std::tan(0.6), 1e-9);  // 467.7424...
  EXPECT_EQ(info.fx, info.fy);
  EXPECT_EQ(info.cx, 320.0);
  EXPECT_EQ(info.cy, 240.0);
  EXPECT_EQ(info.near_clip, 0.05);
  EXPECT_EQ(info.far_clip, 50.0);
  for (double d : info.distortion) EXPECT_EQ(d, 0.0);
  device_info_t device{};
  shot.device.sensor->describe(device);
  EXPECT_NEAR(device.fov_horizontal, 1.2, 1e-12);
  EXPECT_NEAR(device.fov_vertical, 2.0 * std::atan(0.75 * std::tan(0.6)), 1e-5);
  EXPECT_EQ(device.width, 640);
  EXPECT_EQ(device.height, 480);
  EXPECT_EQ(device.range_min, 0.05);
  EXPECT_EQ(device.range_max, 50.0);
}

TEST(Camera, JpegByDefaultInOneDatagram) {
  Shot shot(world_with(kWall));
  const image_t image = shot.image();
  EXPECT_EQ(image.pixelformat, image_t::PIXEL_FORMAT_MJPEG);
  EXPECT_EQ(image.row_stride, 0);
  EXPECT_EQ(image.size, static_cast<int>(image.data.size()));
  const cv::Mat picture = cv::imdecode(image.data, cv::IMREAD_COLOR);
  EXPECT_EQ(picture.cols, 640);
  EXPECT_EQ(picture.rows, 480);
  // A picture of noise hardly compresses: its quality is lowered until it fits.
  Shot noisy(world_with(kWall, "<noise type='gaussian'><stddev>0.1</stddev></noise>"));
  EXPECT_LE(noisy.image().data.size(), 60000u);
  EXPECT_GT(noisy.image().data.size(), 30000u);
  EXPECT_EQ(cv::imdecode(noisy.image().data, cv::IMREAD_COLOR).cols, 640);
}

TEST(Camera, QualityDoesNotFollowThePictureBefore) {
  Shot shot(world_with(kWall, "<noise type='gaussian'><stddev>0.1</stddev></noise>"));
  const std::vector<uint8_t> first = shot.image().data;
  EXPECT_LT(first.size(), 60000u);
  shot.take(0);
  EXPECT_EQ(shot.image().data, first);
}

TEST(Camera, ColoursKeepTheirOrder) {
  const std::string red = box("red", "3.5 0 1 0 0 0", "1 40 40", "<diffuse>1 0.2 0 1</diffuse>");
  const image_t raw = Shot(world_with(red, "", kRaw)).image();
  EXPECT_EQ(raw.pixelformat, image_t::PIXEL_FORMAT_RGB);
  EXPECT_EQ(raw.row_stride, 3 * 640);
  EXPECT_GT(Shot::value(raw, 100, 100, 0), 80);
  EXPECT_LT(Shot::value(raw, 100, 100, 2), 5);
  const cv::Vec3b bgr =
      cv::imdecode(Shot(world_with(red)).image().data, cv::IMREAD_COLOR).at<cv::Vec3b>(100, 100);
  EXPECT_NEAR(bgr[2], Shot::value(raw, 100, 100, 0), 6);
  EXPECT_NEAR(bgr[0], Shot::value(raw, 100, 100, 2), 6);
}

TEST(Camera, Grey) {
  const std::string grey = "<ruedo:encoding>grey</ruedo:encoding>";
  const image_t image = Shot(world_with(kWall, "", grey)).image();
  EXPECT_EQ(image.pixelformat, image_t::PIXEL_FORMAT_GRAY);
  EXPECT_EQ(image.row_stride, 640);
  EXPECT_EQ(image.data.size(), 640u * 480u);
  EXPECT_EQ(Shot::value(image, 320, 240),
            Shot::value(Shot(world_with(kWall, "", kRaw)).image(), 320, 240));
}

TEST(Camera, DepthOfAWallAndOfTheFloor) {
  const std::string floor =
      box("floor", "0 0 -0.5 0 0 0", "40 40 1", "<diffuse>0.5 0.5 0.5 1</diffuse>");
  Shot shot(world_with(kWall + floor, "", "", "rgbd_camera"));
  const double fy = 320.0 / std::tan(0.6);
  EXPECT_EQ(shot.image("/depth").pixelformat, image_t::PIXEL_FORMAT_FLOAT_GRAY32);
  EXPECT_EQ(shot.image("/depth").row_stride, 4 * 640);
  EXPECT_NEAR(shot.depth(10, 20), 3.0, 1e-5);
  EXPECT_NEAR(shot.depth(320, 240), 3.0, 1e-5);
  EXPECT_NEAR(shot.depth(333, 470), 1.0 * fy / (470 - 240), 1e-5);
  Shot open(world_with(floor, "", "<ruedo:depth>true</ruedo:depth>"));
  EXPECT_EQ(open.depth(320, 100), std::numeric_limits<float>::infinity());
  EXPECT_EQ(Shot(world_with(floor)).channel("/depth"), -1);
}

TEST(Camera, WarnsAboutAnUnsupportedFormat) {
  const auto named = [](const std::string& type, const std::string& format) {
    std::string sdf = world_with("", "", "", type);
    sdf.replace(sdf.find("</image>"), 8, "<format>" + format + "</format></image>");
    SensorBench bench(sdf);
    bench.make("eye", "camera");
    return bench.findings.list().size();
  };
  EXPECT_EQ(named("camera", "R8G8B8"), 0u);
  EXPECT_EQ(named("camera", "BAYER_RGGB8"), 1u);
  EXPECT_EQ(named("camera", "R_FLOAT32"), 1u);
  EXPECT_EQ(named("depth_camera", "R_FLOAT32"), 0u);  // that is what its depth is
}

TEST(Camera, Labels) {
  Shot shot(world_with(
      box("left", "4 1 1 0 0 0", "1 1 1", "") + box("right", "4 -1 1 0 0 0", "1 1 1", ""), "",
      "<ruedo:labels>true</ruedo:labels>"));
  const image_t image = shot.image("/labels");
  EXPECT_EQ(image.pixelformat, image_t::PIXEL_FORMAT_LE_GRAY16);
  EXPECT_EQ(image.row_stride, 2 * 640);
  const double fx = 320.0 / std::tan(0.6);
  const auto label = [&](double y) {
    const int u = static_cast<int>(320 - fx * y / 4);
    return Shot::value(image, u, 240, 0) + 256 * Shot::value(image, u, 240, 1);
  };
  EXPECT_EQ(label(1), 1);
  EXPECT_EQ(label(-1), 2);
  EXPECT_EQ(label(0), 0);
}

TEST(Camera, WithoutNoiseEverySampleIsTheIdealOne) {
  const std::string noise = "<noise type='gaussian'><mean>0.01</mean><stddev>0.05</stddev></noise>";
  SensorBench::Options off;
  off.noise = false;
  const image_t ideal = Shot(world_with(kWall, "", kRaw)).image();
  EXPECT_EQ(Shot(world_with(kWall, noise, kRaw), off).image().data, ideal.data);
  EXPECT_EQ(Shot(world_with(kWall, noise, kRaw), off, 5).image().data, ideal.data);
  EXPECT_NE(Shot(world_with(kWall, noise, kRaw)).image().data, ideal.data);
}

struct Moments {
  double mean = 0, sigma = 0;
};
Moments moments(const std::vector<double>& values) {
  Moments m;
  for (double v : values) m.mean += v / static_cast<double>(values.size());
  for (double v : values)
    m.sigma += (v - m.mean) * (v - m.mean) / static_cast<double>(values.size());
  m.sigma = std::sqrt(m.sigma);
  return m;
}

TEST(Camera, NoiseHasItsDistribution) {
  const image_t ideal = Shot(world_with(kWall, "", kRaw)).image();
  Shot noisy(world_with(
      kWall, "<noise><type>gaussian</type><mean>0.02</mean><stddev>0.03</stddev></noise>", kRaw));
  const image_t first = noisy.image();
  std::vector<double> errors, products, standard;
  for (size_t i = 0; i < ideal.data.size(); ++i)
    errors.push_back(double(first.data[i]) - ideal.data[i]);
  const Moments m = moments(errors);
  // 921 600 draws: the mean to 5 sigma / sqrt(n), and sigma with the variance 1/12 of rounding to
  // whole values.
  const double n = static_cast<double>(errors.size()),
               sigma = std::sqrt(255 * 255 * 0.03 * 0.03 + 1.0 / 12);
  EXPECT_NEAR(m.mean, 255 * 0.02, 5 * sigma / std::sqrt(n));
  EXPECT_NEAR(m.sigma, sigma, 5 * sigma / std::sqrt(2 * n));
  // Kolmogorov's distance to the normal distribution, read where the rounding does not matter (half
  // values).
  double worst = 0;
  for (int edge = -20; edge <= 30; ++edge) {
    const double below =
        static_cast<double>(
            std::count_if(errors.begin(), errors.end(), [&](double e) { return e < edge + 0.5; })) /
        n;
    worst = std::max(worst, std::abs(below - 0.5 * std::erfc(-(edge + 0.5 - 255 * 0.02) /
                                                             (255 * 0.03) / std::sqrt(2.0))));
  }
  EXPECT_LT(worst, 1.95 / std::sqrt(n));  // 0.1 % of true ones would fail
  // Independent from pixel to pixel, colour to colour, and sample to sample.
  noisy.take(1);
  const image_t second = noisy.image();
  for (const size_t lag : {size_t{1}, size_t{2}, size_t{3}, size_t{4}, size_t{640 * 3}}) {
    double sum = 0;
    for (size_t i = lag; i < errors.size(); ++i)
      sum += (errors[i] - m.mean) * (errors[i - lag] - m.mean);
    EXPECT_LT(std::abs(sum / n), 5 * m.sigma * m.sigma / std::sqrt(n)) << lag;
  }
  double sum = 0;
  for (size_t i = 0; i < errors.size(); ++i)
    sum += (errors[i] - m.mean) * (double(second.data[i]) - ideal.data[i] - m.mean);
  EXPECT_LT(std::abs(sum / n), 5 * m.sigma * m.sigma / std::sqrt(n));
}

TEST(Camera, NoiseDependsOnSeedNamesAndSampleOnly) {
  const std::string sdf =
      world_with(kWall, "<noise type='gaussian'><stddev>0.03</stddev></noise>", kRaw);
  SensorBench::Options other_seed, other_robot;
  other_seed.seed = 2;
  other_robot.named_robot = "another";
  const image_t image = Shot(sdf, {}, 3).image();
  EXPECT_EQ(Shot(sdf, {}, 3).image().data, image.data);
  EXPECT_NE(Shot(sdf, {}, 4).image().data, image.data);
  EXPECT_NE(Shot(sdf, other_seed, 3).image().data, image.data);
  EXPECT_NE(Shot(sdf, other_robot, 3).image().data, image.data);
}

TEST(PixelNoise, SaturatesAtBothEnds) {
  std::vector<uint8_t> dark(1000, 0), bright(1000, 255);
  const PixelNoise noise(0.0, 0.5);
  noise.apply(RandomStream(1, 1), dark);
  noise.apply(RandomStream(1, 1), bright);
  EXPECT_GT(std::count(dark.begin(), dark.end(), 0), 400);
  EXPECT_GT(std::count(bright.begin(), bright.end(), 255), 400);
  EXPECT_EQ(*std::max_element(dark.begin(), dark.end()),
            255);  // some of a thousand draws reach beyond 2 sigma
  EXPECT_EQ(*std::min_element(bright.begin(), bright.end()), 0);
}

TEST(Camera, VignettingTakesLightInTheCorners) {
  const image_t plain = Shot(world_with(kWall, "", kRaw)).image();
  const image_t dark =
      Shot(world_with(kWall, "", kRaw + "<ruedo:vignetting>0.75</ruedo:vignetting>")).image();
  EXPECT_EQ(Shot::value(dark, 320, 240), Shot::value(plain, 320, 240));
  // Light is the square of the value: a quarter of the light is half of the value.
  EXPECT_NEAR(Shot::value(dark, 0, 0), 0.5 * Shot::value(plain, 0, 0), 1.0);
}

TEST(Camera, ExposureInStops) {
  const std::string lamp =
      box("wall", "3.5 0 1 0 0 0", "1 40 40",
          "<diffuse>0 0 0 1</diffuse><ambient>0 0 0 1</ambient><emissive>0.4 0.4 0.4 1</emissive>");
  EXPECT_NEAR(Shot::value(Shot(world_with(lamp, "", kRaw)).image(), 320, 240), 102, 1);
  EXPECT_NEAR(
      Shot::value(Shot(world_with(lamp, "", kRaw + "<ruedo:exposure>2</ruedo:exposure>")).image(),
                  320, 240),
      204, 1);
}

Lens lens_of(const std::string& in_camera) {
  SensorBench bench(world_with("", in_camera));
  return Lens(*bench.world->models[0].model->sensors.at(0).element->child("camera"));
}

TEST(CameraLens, DistortionIsOpenCvs) {
  const Lens lens = lens_of(
      "<distortion><k1>-0.25</k1><k2>0.1</k2><k3>-0.02</k3><p1>0.003</p1><p2>-0.002</p2></"
      "distortion>");
  EXPECT_EQ(lens.distortion, (std::array<double, 5>{-0.25, 0.1, 0.003, -0.002, -0.02}));
  // By hand, x = 0.5, y = -0.4: r^2 = 0.41, radial = 1 - 0.1025 + 0.01681 - 0.00137842 =
  // 0.91293158; x' = 0.45646579 + 2 p1 x y (-0.0012) + p2 (0.41 + 0.5) (-0.00182) = 0.45344579; y'
  // = -0.365172632 + p1 (0.41 + 0.32) (0.00219) + 2 p2 x y (0.0008) = -0.362182632.
  const Eigen::Vector2d seen = lens.distort({0.5, -0.4});
  EXPECT_NEAR(seen.x(), 0.45344579, 1e-9);
  EXPECT_NEAR(seen.y(), -0.362182632, 1e-9);
  Eigen::Vector2d back;
  ASSERT_TRUE(lens.undistort(seen, back));
  EXPECT_NEAR(back.x(), 0.5, 1e-9);
  EXPECT_NEAR(back.y(), -0.4, 1e-9);
}

TEST(CameraLens, NothingIsSeenBeyondAFold) {
  // r (1 - 0.5 r^2) has its maximum 0.5443 at r = 0.8165: no ideal point beyond that is visible.
  const Lens lens = lens_of("<distortion><k1>-0.5</k1></distortion>");
  Eigen::Vector2d p;
  EXPECT_TRUE(lens.undistort({0.54, 0.0}, p));
  EXPECT_NEAR(p.x() * (1 - 0.5 * p.x() * p.x()), 0.54, 1e-9);
  EXPECT_LT(p.x(), 0.8165);
  EXPECT_FALSE(lens.undistort({0.55, 0.0}, p));
}

// A <camera> with a lens that folds at once, so that its map is made quickly.
std::shared_ptr<const Element> folding_camera(int width, const std::string& k1) {
  return world::parse_document("<camera><horizontal_fov>2.9</horizontal_fov><image><width>" +
                                   std::to_string(width) +
                                   "</width><height>3000</height></image><distortion><k1>" + k1 +
                                   "</k1></distortion></camera>",
                               "camera.sdf");
}
std::shared_ptr<const LensMap> map_of(const Element& camera, const world::WorldModel& world) {
  return LensMap::of(Lens(camera), camera, world);
}

TEST(CameraLens, EqualOnesShareTheirMap) {
  const world::WorldModel world, other;
  const auto map = map_of(*folding_camera(100, "-10"), world);
  EXPECT_EQ(map_of(*folding_camera(100, "-10"), world), map);
  EXPECT_EQ(map_of(*folding_camera(100, "-10"), other), map);
  EXPECT_NE(map_of(*folding_camera(100, "-9"), world), map);
}

TEST(CameraLens, PixelsOfAllThatDifferAreBounded) {
  const world::WorldModel world, other;
  const auto first = map_of(*folding_camera(4000, "-10"), world);
  const auto third = folding_camera(100, "-8");
  {
    const auto second = map_of(*folding_camera(4000, "-9"), world);
    EXPECT_NO_THROW(map_of(*third, other)) << "each world has its own bound";
    try {
      map_of(*third, world);
      FAIL();
    } catch (const InputError& error) {
      EXPECT_EQ(error.message(),
                "<distortion>: the pictures of all lenses with distortion have 24300000 pixels "
                "with this one; at most 24000000 are distorted in a world, those of equal lenses "
                "counted once");
    }
  }
  EXPECT_NO_THROW(map_of(*third, world)) << "one of those before it is gone";
}

TEST(Camera, ThingsAreSeenWhereTheLensBendsThem) {
  // A small lamp; its middle is ideally at x = y = 0.4 in the optical frame.
  const std::string lamp = box("lamp", "2.5 -1.0 0 0 0 0", "0.001 0.03 0.03",
                               "<diffuse>0 0 0 1</diffuse><emissive>1 1 1 1</emissive>");
  for (const auto& [xml, k1] : {std::pair{"", 0.0},
                                {"<distortion><k1>-0.3</k1></distortion>", -0.3},
                                {"<distortion><k1>0.2</k1></distortion>", 0.2}}) {
    Shot shot(world_with(
        lamp, xml, kRaw + "<ruedo:labels>true</ruedo:labels><ruedo:depth>true</ruedo:depth>"));
    const image_t labels = shot.image("/labels");
    double u = 0, v = 0, n = 0;
    for (int row = 0; row < 480; ++row) {
      for (int column = 0; column < 640; ++column) {
        if (Shot::value(labels, column, row) == 0) continue;
        u += column, v += row, ++n;
        EXPECT_NEAR(shot.depth(column, row), 2.5, 0.001);
        EXPECT_GT(Shot::value(shot.image(), column, row), 90);
      }
    }
    ASSERT_GT(n, 8);
    const double scale = 320.0 / std::tan(0.6) * 0.4 * (1.0 + k1 * 0.32);
    EXPECT_NEAR(u / n, 320 + scale, 0.6) << k1;
    EXPECT_NEAR(v / n, 240 + scale, 0.6) << k1;
  }
}

TEST(Camera, RefusesInvalidElements) {
  struct Case {
    const char *in_camera, *in_sensor, *says;
  };
  const Case cases[] = {
      {"<horizontal_fov>-1</horizontal_fov>", "", "horizontal_fov"},
      {"<horizontal_fov>3.5</horizontal_fov>", "", "horizontal_fov"},
      {"<image><width>0</width><height>480</height></image>", "", "width"},
      {"<image><width>64</width><height>100000</height></image>", "", "height"},
      {"<clip><near>0</near><far>10</far></clip>", "", "near"},
      {"<clip><near>5</near><far>2</far></clip>", "", "far (2 m) has to be beyond near (5 m)"},
      {"<clip><near>2e-8</near><far>1e-8</far></clip>", "",
       "far (1e-08 m) has to be beyond near (2e-08 m)"},
      {"<noise type='uniform'/>", "", "uniform"},
      {"<noise type='gaussian'><stddev>-1</stddev></noise>", "", "stddev"},
      {"<distortion><k1>1e9</k1></distortion>", "", "k1"},
      {"", "<ruedo:encoding>webp</ruedo:encoding>", "webp"},
      {"", "<ruedo:quality>0</ruedo:quality>", "quality"},
      {"", "<ruedo:vignetting>2</ruedo:vignetting>", "vignetting"},
      {"", "<ruedo:exposure>often</ruedo:exposure>", "exposure"},
      {"", "<ruedo:encodings>rgb</ruedo:encodings>", "ruedo:encoding"},
  };
  for (const Case& c : cases) {
    // The case's elements come first, and of several elements of a name the first is read.
    std::string sdf = world_with("", "", c.in_sensor);
    sdf.replace(sdf.find("<camera>"), 8, "<camera>" + std::string(c.in_camera));
    try {
      SensorBench bench(sdf);
      bench.make("eye", "camera");
      ADD_FAILURE() << c.in_camera << c.in_sensor << " is taken";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(c.says), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("bench.sdf:"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace ruedo
