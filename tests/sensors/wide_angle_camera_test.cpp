// Wide-angle cameras: where they show small bright objects at known angles.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ruedo/image_t.hpp"
#include "scene/pictures/render_scene.h"
#include "sensors/sensor_bench.h"

namespace ruedo {
namespace {

using test::Device;
using test::SensorBench;
using testing::HasSubstr;

// A glowing ball 5 m away, at that angle to the left of the camera's axis, in the dark.
std::string world(double angle, const std::string& lens, double hfov, double up = 0) {
  const Vec3 p =
      5 * Vec3(std::cos(angle), std::sin(angle) * std::cos(up), std::sin(angle) * std::sin(up));
  return "<sdf version='1.9'><world name='w'><scene><background>0 0 0 1</background><ambient>0 0 0 "
         "1"
         "</ambient></scene><model name='ball'><static>true</static><pose>" +
         std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) +
         " 0 0 0</pose><link name='l'><visual name='v'><geometry><sphere><radius>0.1</radius>"
         "</sphere></geometry><material><emissive>1 1 1 1</emissive></material></visual></link>"
         "</model><model name='eye'><static>true</static><link name='link'>"
         "<sensor name='camera' type='wideanglecamera'><ruedo:encoding>rgb</ruedo:encoding>"
         "<camera><horizontal_fov>" +
         std::to_string(hfov) +
         "</horizontal_fov><image><width>200</width><height>200</height></image>"
         "<lens><env_texture_size>256</env_texture_size>" +
         lens + "</lens></camera></sensor></link></model></world></sdf>";
}

// The middle of the light, in pixels from the picture's middle: to the left, upwards.
Eigen::Vector2d light(const std::string& sdf) {
  SensorBench bench(sdf);
  Device device = bench.make("eye", "camera");
  const auto renderer = scene::make_renderer(*bench.world, bench.layout);
  Outbox out;
  device.sensor->sample({bench.snapshot(), 0, nullptr, renderer.get()}, out);
  const image_t image = Device::decode<image_t>(out).at(0);
  double sum = 0;
  Eigen::Vector2d weighed(0, 0);
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      const double value = image.data[row * image.row_stride + 3 * column];
      sum += value;
      weighed += value * Eigen::Vector2d(100 - column, 100 - row);
    }
  }
  return sum > 0 ? Eigen::Vector2d(weighed / sum) : Eigen::Vector2d(-1000, -1000);
}

// Half the width, 100 pixels, is half of <horizontal_fov>.
TEST(WideAngleCamera, ProjectionsAreThoseOfTheirNames) {
  struct Case {
    const char* type;
    double hfov;
    double (*fun)(double);
  };
  for (const Case& c : {Case{"gnomonical", 2.0, [](double t) { return std::tan(t); }},
                        Case{"stereographic", 3.0, [](double t) { return std::tan(t / 2); }},
                        Case{"equidistant", 3.0, [](double t) { return t; }},
                        Case{"equisolid_angle", 3.0, [](double t) { return std::sin(t / 2); }},
                        Case{"orthographic", 3.0, [](double t) { return std::sin(t); }}}) {
    const std::string lens = std::string("<type>") + c.type + "</type>";
    for (const double angle : {0.2, 0.9}) {
      const Eigen::Vector2d seen = light(world(angle, lens, c.hfov));
      EXPECT_NEAR(seen.x(), 100 * c.fun(angle) / c.fun(c.hfov / 2), 0.5) << c.type << " " << angle;
      EXPECT_NEAR(seen.y(), 0, 0.5) << c.type;
    }
  }
}

// Across the edges of the cube, in every direction, and behind the camera.
TEST(WideAngleCamera, SeesAllAround) {
  const std::string lens = "<type>equidistant</type><cutoff_angle>3.1</cutoff_angle>";
  for (const double angle : {0.8, 1.5, 2.4}) {
    for (const double up : {0.0, 0.8, 1.6, 3.1, 4.0}) {
      const Eigen::Vector2d seen = light(world(angle, lens, 6.0, up));
      const double r = 100 * angle / 3.0;
      EXPECT_NEAR(seen.x(), r * std::cos(up), 1.0) << angle << " " << up;
      EXPECT_NEAR(seen.y(), r * std::sin(up), 1.0) << angle << " " << up;
    }
  }
}

TEST(WideAngleCamera, CustomFunctionsAndTheCutoff) {
  const std::string custom =
      "<type>custom</type><custom_function><c1>2</c1><c2>2</c2><f>0.5</f><fun>sin</fun>"
      "</custom_function>";
  EXPECT_NEAR(light(world(0.5, custom, 3.0)).x(), 100 * std::sin(0.25) / std::sin(0.75), 0.5);
  // Not scaled: r = 2 0.5 sin(theta / 2) of half the width.
  EXPECT_NEAR(light(world(0.5, custom + "<scale_to_hfov>false</scale_to_hfov>", 3.0)).x(),
              100 * std::sin(0.25), 0.5);
  EXPECT_EQ(light(world(1.3, "<type>equidistant</type><cutoff_angle>1</cutoff_angle>", 3.0)).x(),
            -1000);
}

TEST(WideAngleCamera, RefusedConfigurations) {
  struct Case {
    const char* lens;
    double hfov;
    const char* error;
  };
  for (const Case& c :
       {Case{"<type>flat</type>", 2, "'flat' is not allowed"},
        Case{"<type>gnomonical</type>", 3.5, "is too wide for it"},
        Case{"<type>orthographic</type><cutoff_angle>3</cutoff_angle>", 5, "is too wide for it"},
        Case{"<cutoff_angle>-1</cutoff_angle>", 2, "'-1' is not allowed"}}) {
    try {
      SensorBench bench(world(0, c.lens, c.hfov));
      bench.make("eye", "camera");
      ADD_FAILURE() << c.error;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(c.error));
    }
  }
}

}  // namespace
}  // namespace ruedo
