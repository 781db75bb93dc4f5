// Cameras that show what things are: segmentation, bounding boxes, temperatures, the logical
// camera; against projections by hand.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ruedo/boxes_2d_t.hpp"
#include "ruedo/boxes_3d_t.hpp"
#include "ruedo/camera_info_t.hpp"
#include "ruedo/image_t.hpp"
#include "ruedo/logical_camera_t.hpp"
#include "scene/pictures/render_scene.h"
#include "sensors/sensor_bench.h"

namespace ruedo {
namespace {

using test::Device;
using test::SensorBench;
using testing::ElementsAre;
using testing::HasSubstr;

std::string label(int value) {
  return "<plugin filename='gz-sim-label-system' name='gz::sim::systems::Label'><label>" +
         std::to_string(value) + "</label></plugin>";
}

std::string thermal(const std::string& inside) {
  return "<plugin filename='gz-sim-thermal-system' name='gz::sim::systems::Thermal'>" + inside +
         "</plugin>";
}

std::string box(const std::string& name, const std::string& pose, const std::string& size,
                const std::string& in_visual = "", const std::string& in_model = "") {
  return "<model name='" + name + "'><static>true</static><pose>" + pose + "</pose>" + in_model +
         "<link name='l'><visual name='v'><geometry><box><size>" + size +
         "</size></box></geometry>" + in_visual + "</visual></link></model>";
}

// 100 pixels for a slope of 1, the middle at (100, 50). A crate whose front face is 4.5 m ahead, a
// second one 3 m to its right, a wall 7.5 m ahead, and a near board that hides everything to the
// left of the middle, but nothing of the second crate.
const std::string kThings =
    box("crate", "5 0 1 0 0 0", "1 1 1", thermal("<temperature>310</temperature>"), label(7)) +
    box("other", "5 -3 1 0 0 0", "1 1 1", "", label(7)) +
    box("wall", "8 0 1 0 0 0", "1 6.1 1", label(3), label(5)) +
    box("board", "3 1.02 1 0 0 0", "0.1 2 2");

std::string world(const std::string& type, const std::string& in_camera = "",
                  const std::string& in_sensor = "", const std::string& things = kThings) {
  return "<sdf version='1.9'><world name='w'>" + things +
         "<model name='eye'><static>true</static><pose>0 0 1 0 0 0</pose><link name='link'>"
         "<sensor name='camera' type='" +
         type + "'>" + in_sensor +
         "<camera><horizontal_fov>1.5707963267948966</horizontal_fov><image><width>200</width>"
         "<height>100</height>" +
         (in_camera.find("<format>") == std::string::npos ? "" : in_camera) +
         "</image><clip><near>0.05</near><far>50</far></clip>" +
         (in_camera.find("<format>") == std::string::npos ? in_camera : "") +
         "</camera></sensor></link></model></world></sdf>";
}

struct Shot {
  explicit Shot(const std::string& sdf, SensorBench::Options options = {})
      : bench(sdf),
        device(bench.make("eye", "camera", options)),
        renderer(scene::make_renderer(*bench.world, bench.layout)) {
    device.sensor->sample({bench.snapshot(), 0, nullptr, renderer.get()}, out);
  }
  template <class Message>
  Message message() const {
    return Device::decode<Message>(out, 0).at(0);
  }
  SensorBench bench;
  Device device;
  std::unique_ptr<scene::Renderer> renderer;
  Outbox out;
};

int pixel(const image_t& image, int row, int column) {
  const int bytes = image.row_stride / image.width;
  const size_t at = static_cast<size_t>(row * image.row_stride + column * bytes);
  return bytes == 1 ? image.data[at] : image.data[at] + 256 * image.data[at + 1];
}

TEST(SegmentationCamera, ShowsClasses) {
  const Shot shot(world("segmentation"));
  EXPECT_EQ(shot.device.channels, (std::vector<std::string>{"eye/camera", "eye/camera/info"}));
  const image_t image = shot.message<image_t>();
  EXPECT_EQ(image.pixelformat, image_t::PIXEL_FORMAT_GRAY);
  EXPECT_EQ(image.size, 200 * 100);
  EXPECT_EQ(pixel(image, 50, 105), 7);
  EXPECT_EQ(pixel(image, 50, 165), 7);
  EXPECT_EQ(pixel(image, 50, 130), 3);  // the visual's own label, not the model's
  EXPECT_EQ(pixel(image, 50, 90), 0);   // the board has none
  EXPECT_EQ(pixel(image, 5, 105), 0);
  const camera_info_t info = Device::decode<camera_info_t>(shot.out, 1).at(0);
  EXPECT_NEAR(info.fx, 100, 1e-9);
}

TEST(SegmentationCamera, CountsTheModelsOfAClass) {
  for (const char* type : {"instance", "panoptic"}) {
    const image_t image = Shot(world("segmentation_camera", std::string("<segmentation_type>") +
                                                                type + "</segmentation_type>"))
                              .message<image_t>();
    EXPECT_EQ(image.pixelformat, image_t::PIXEL_FORMAT_LE_GRAY16);
    EXPECT_EQ(pixel(image, 50, 105), 7 * 256 + 1);
    EXPECT_EQ(pixel(image, 50, 165), 7 * 256 + 2);
    EXPECT_EQ(pixel(image, 50, 130), 3 * 256 + 1);
    EXPECT_EQ(pixel(image, 50, 90), 0);
  }
}

void expect_box(const box_2d_t& box, const char* name, int label, double x, double y, double width,
                double height, double tolerance) {
  EXPECT_EQ(box.name, name);
  EXPECT_EQ(box.label, label);
  EXPECT_NEAR(box.x, x, tolerance);
  EXPECT_NEAR(box.y, y, tolerance);
  EXPECT_NEAR(box.width, width, tolerance);
  EXPECT_NEAR(box.height, height, tolerance);
}

// Half a metre at 4.5 m are 11.1 pixels: columns 89 to 111, of which the board leaves those from
// 100 on. The other crate's near face is seen from 2.5 / 4.5 to 3.5 / 4.5, columns 156 to 177; its
// inner side begins at 2.5 / 5.5, column 146. The wall ends at 3.05 / 7.5, column 140, and the
// crate hides it up to 111; its height, 0.5 / 7.5, are 6.67 pixels to each side.
TEST(BoxesCamera, VisibleBoxesAreAroundThePixels) {
  const boxes_2d_t seen = Shot(world("boundingbox_camera")).message<boxes_2d_t>();
  EXPECT_EQ(seen.width, 200);
  ASSERT_EQ(seen.n, 3);
  expect_box(seen.boxes[0], "crate", 7, 105.5, 50, 12, 23, 0);
  expect_box(seen.boxes[1], "other", 7, 161.5, 50, 32, 23, 0);
  expect_box(seen.boxes[2], "wall", 3, 126, 50, 29, 13, 0);
}

TEST(BoxesCamera, FullBoxesAreThoseOfTheCorners) {
  const boxes_2d_t seen =
      Shot(world("boundingbox", "<box_type>full_2d</box_type>")).message<boxes_2d_t>();
  ASSERT_EQ(seen.n, 3);
  expect_box(seen.boxes[0], "crate", 7, 100, 50, 100 / 4.5, 100 / 4.5, 1e-9);
  expect_box(seen.boxes[1], "other", 7, 100 + 50 * (3.5 / 4.5 + 2.5 / 5.5), 50,
             100 * (3.5 / 4.5 - 2.5 / 5.5), 100 / 4.5, 1e-9);
  expect_box(seen.boxes[2], "wall", 3, 100, 50, 610 / 7.5, 100 / 7.5, 1e-9);
}

// Partly outside of the picture, it is cut off at the picture's edge.
TEST(BoxesCamera, FullBoxesEndAtThePicturesEdge) {
  const boxes_2d_t seen = Shot(world("boundingbox", "<box_type>full_box_2d</box_type>", "",
                                     box("crate", "5 -5 1 0 0 0", "1 2 1", "", label(1))))
                              .message<boxes_2d_t>();
  ASSERT_EQ(seen.n, 1);
  EXPECT_NEAR(seen.boxes[0].x + seen.boxes[0].width / 2, 199.5, 1e-9);
  EXPECT_NEAR(seen.boxes[0].x - seen.boxes[0].width / 2, 100 + 400 / 5.5, 1e-9);
}

TEST(BoxesCamera, SolidBoxesAreInTheCamerasFrame) {
  const boxes_3d_t seen = Shot(world("boundingbox", "<box_type>3d</box_type>", "",
                                     box("crate", "5 0.5 1.25 0 0 0.5", "1 2 3", "", label(1))))
                              .message<boxes_3d_t>();
  ASSERT_EQ(seen.n, 1);
  const box_3d_t& b = seen.boxes[0];
  EXPECT_EQ(b.name, "crate");
  const double center[] = {5, 0.5, 0.25}, size[] = {1, 2, 3};
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(b.center[i], center[i], 1e-12);
    EXPECT_NEAR(b.size[i], size[i], 1e-12);
  }
  EXPECT_NEAR(b.orientation[0], std::cos(0.25), 1e-12);
  EXPECT_NEAR(b.orientation[3], std::sin(0.25), 1e-12);
}

TEST(ThermalCamera, ShowsTemperaturesInItsResolution) {
  const image_t image = Shot(world("thermal")).message<image_t>();
  EXPECT_EQ(image.pixelformat, image_t::PIXEL_FORMAT_LE_GRAY16);
  EXPECT_EQ(pixel(image, 50, 105), 31000);
  EXPECT_EQ(pixel(image, 50, 130), 28815);  // of the air
  EXPECT_EQ(pixel(image, 2, 2), 28815);
  const image_t coarse = Shot(world("thermal_camera", "<format>L8</format>")).message<image_t>();
  EXPECT_EQ(coarse.pixelformat, image_t::PIXEL_FORMAT_GRAY);
  EXPECT_EQ(pixel(coarse, 50, 105), 103);
  EXPECT_EQ(pixel(coarse, 50, 130), 96);
  const image_t narrow =
      Shot(world("thermal", "",
                 "<plugin filename='gz-sim-thermal-sensor-system' "
                 "name='gz::sim::systems::ThermalSensor'><min_temp>290</min_temp>"
                 "<max_temp>300</max_temp><resolution>0.5</resolution></plugin>"))
          .message<image_t>();
  EXPECT_EQ(pixel(narrow, 50, 105), 600);
  EXPECT_EQ(pixel(narrow, 50, 130), 580);
}

TEST(ThermalCamera, NoiseIsInKelvin) {
  const image_t image =
      Shot(world("thermal",
                 "<noise><type>gaussian</type><mean>1</mean><stddev>0.5</stddev></noise>", "", ""))
          .message<image_t>();
  double sum = 0, squares = 0;
  for (int i = 0; i < 200 * 100; ++i) {
    const double z = (0.01 * pixel(image, i / 200, i % 200) - 289.15) / 0.5;
    sum += z, squares += z * z;
  }
  EXPECT_LT(std::abs(sum), 3.29 * std::sqrt(20000.0));
  EXPECT_NEAR(squares / 20000, 1.0, 3.29 * std::sqrt(2.0 / 20000));
}

TEST(ThermalCamera, UsesTheMeanOfAHeatSignatureAndWarns) {
  SensorBench bench(world("thermal", "", "",
                          box("crate", "5 0 1 0 0 0", "1 1 1",
                              thermal("<heat_signature>heat.png</heat_signature><min_temp>290"
                                      "</min_temp><max_temp>310</max_temp>"))));
  ASSERT_EQ(bench.world->findings.size(), 1u);
  EXPECT_THAT(bench.world->findings[0].text, HasSubstr("<heat_signature> is not supported"));
  EXPECT_EQ(bench.world->models[0].model->links[0].visuals[0].temperature, 300);
}

// Half the width of 2 m at 2 m is 1 m to each side, half of it upwards: the crate lies within, the
// other one does not, nor what is too far or too near.
TEST(LogicalCamera, ListsModelsWithTheirOriginInTheFrustum) {
  const std::string view =
      "<logical_camera><near>1</near><far>6</far><horizontal_fov>1.0</horizontal_fov>"
      "<aspect_ratio>2</aspect_ratio></logical_camera>";
  SensorBench bench(world("logical_camera", "", view,
                          kThings + box("high", "4 0 2.2 0 0 0", "1 1 1") +
                              box("low", "4 0 1.9 0 0 0.5", "1 1 1") +
                              box("near", "0.5 0 1 0 0 0", "1 1 1")));
  Device device = bench.make("eye", "camera");
  Outbox out;
  device.sensor->sample({bench.snapshot(), 0, nullptr, nullptr}, out);
  const logical_camera_t seen = Device::decode<logical_camera_t>(out).at(0);
  std::vector<std::string> names;
  for (const logical_object_t& object : seen.objects) names.push_back(object.model);
  EXPECT_THAT(names, ElementsAre("crate", "board", "low"));
  EXPECT_EQ(seen.objects.at(0).position[0], 5);
  EXPECT_NEAR(seen.objects.at(2).position[2], 0.9, 1e-15);
  EXPECT_NEAR(seen.objects.at(2).orientation[3], std::sin(0.25), 1e-15);
}

TEST(LabelledCameras, ReportElementsWithoutEffect) {
  struct Case {
    const char* type;
    const char* in_camera;
    const char* text;
  };
  for (const Case& c :
       {Case{"segmentation", "<noise><type>gaussian</type><stddev>1</stddev></noise>",
             "<noise> is not supported and left out"},
        Case{"boundingbox", "<depth_camera/>", "<depth_camera> is not supported and left out"},
        Case{"thermal",
             "<noise><type>gaussian</type><dynamic_bias_stddev>1</dynamic_bias_stddev>"
             "</noise>",
             "pixels do not drift"},
        Case{"wideanglecamera", "<lens><type>equidistant</type><intrinsics/></lens>",
             "<intrinsics> is not supported"}}) {
    SensorBench bench(world(c.type, c.in_camera));
    bench.make("eye", "camera");
    ASSERT_EQ(bench.findings.list().size(), 1u) << c.text;
    EXPECT_THAT(bench.findings.list()[0].text, HasSubstr(c.text));
  }
}

TEST(LabelledCameras, RefusedConfigurations) {
  struct Case {
    const char* type;
    const char* in_camera;
    const char* in_sensor;
    const char* error;
  };
  for (const Case& c :
       {Case{"boundingbox", "<box_type>4d</box_type>", "", "'4d' is not allowed"},
        Case{"segmentation", "<segmentation_type>x</segmentation_type>", "", "'x' is not allowed"},
        Case{"thermal", "",
             "<plugin filename='gz-sim-thermal-sensor-system'><min_temp>300</min_temp><max_temp>290"
             "</max_temp></plugin>",
             "max_temp has to be above min_temp"},
        Case{"logical_camera", "", "<logical_camera><near>2</near><far>1</far></logical_camera>",
             "far has to be beyond near"}}) {
    try {
      SensorBench bench(world(c.type, c.in_camera, c.in_sensor));
      bench.make("eye", "camera");
      ADD_FAILURE() << c.error;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("bench.sdf:1: "));
      EXPECT_THAT(error.what(), HasSubstr(c.error));
    }
  }
}

}  // namespace
}  // namespace ruedo
