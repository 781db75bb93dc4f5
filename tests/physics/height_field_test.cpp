// Height maps as ground: the surface that their formula says, and no edges where it is smooth.
#include <cmath>
#include <functional>
#include <tuple>

#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "world.h"

namespace ruedo::physics::testing {
namespace {

constexpr double kHigh = 2.0;  // m: white

class HeightFields : public ::testing::Test {
 protected:
  // Heights between 0 and kHigh over 20 m x 10 m, about (0, 0).
  std::string ground(int columns, int rows, const std::function<double(double, double)>& height,
                     const std::string& at = "0 0 0") {
    std::string picture = "P5 " + std::to_string(columns) + " " + std::to_string(rows) + " 65535\n";
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const double x = 20.0 * column / (columns - 1) - 10.0, y = 5.0 - 10.0 * row / (rows - 1);
        const auto number = static_cast<int>(std::lround(height(x, y) / kHigh * 65535));
        picture += static_cast<char>(number >> 8);
        picture += static_cast<char>(number & 255);
      }
    }
    return "<model name='ground'><static>true</static><pose>0 0 0.5 0 0 0</pose><link name='l'>"
           "<collision name='c'><geometry><heightmap><uri>" +
           folder_.write("hills.pgm", picture) + "</uri><size>20 10 2</size><pos>" + at +
           "</pos></heightmap></geometry></collision></link></model>";
  }
  static std::string ball(double x, double y, double z) {
    return thing("ball",
                 std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + " 0 0 0",
                 "<sphere><radius>0.1</radius></sphere>", 1.0, 0.5, 0.004);
  }
  TemporaryFolder folder_;
};

// A solid ball (2/5 m r^2) rolls down an incline with 5/7 g sin(a).
TEST_F(HeightFields, ABallRollsDownAnInclineLikeOnAPlane) {
  const double slope = 0.08, angle = std::atan(slope), start = 0.1 / std::cos(angle);
  for (const auto& [columns, rows] : {std::pair(513, 257), {41, 23}, {2, 2}}) {
    World w(ground(columns, rows, [&](double x, double) { return 1.0 + slope * x; }) +
            ball(5, 0.3, 0.5 + 1.0 + slope * 5 + start));
    w.run(2.0);
    const Vec3 at = w.position("ball/l");
    const double way = 0.5 * 5.0 / 7.0 * 10.0 * std::sin(angle) * 4.0;
    EXPECT_NEAR(at.x(), 5 - way * std::cos(angle), 0.01 * way) << columns;
    EXPECT_NEAR(at.y(), 0.3, 1e-3) << columns;
    EXPECT_NEAR(at.z(), 0.5 + 1.0 + slope * at.x() + start, 2e-4) << columns;
  }
}

TEST_F(HeightFields, ABallRestsInAValley) {
  const auto valley = [](double x, double y) {
    return 1.0 + 0.4 * std::sin(x) + 0.3 * std::cos(1.5 * y);
  };
  const double x = -M_PI / 2, y = M_PI / 1.5;  // its lowest point
  World w(ground(1025, 513, valley, "1 2 -0.25") + ball(x + 1, y + 2, 0.5 - 0.25 + 0.3 + 0.1));
  w.run(2.0);
  const Vec3 at = w.position("ball/l");
  EXPECT_NEAR(at.x(), x + 1, 0.02);
  EXPECT_NEAR(at.y(), y + 2, 0.02);
  EXPECT_NEAR(at.z(), 0.5 - 0.25 + 0.3 + 0.1, 1e-3);
}

// Next to its edge there is nothing.
TEST_F(HeightFields, ThingsFallBesideTheMap) {
  const std::string flat = ground(65, 33, [](double, double) { return 1.0; });
  for (const auto& [x, y, stands] :
       {std::tuple(9.9, 0.0, true), {10.2, 0.0, false}, {0.0, 4.9, true}, {0.0, -5.2, false}}) {
    World w(flat + ball(x, y, 0.5 + 1.0 + 0.1));
    w.run(0.5);
    EXPECT_NEAR(w.position("ball/l").z(), stands ? 1.6 : 1.6 - 0.5 * 10 * 0.25, 0.02) << x << y;
  }
}

// Rolling over many cells costs no height and no speed: edges between them are not felt.
TEST_F(HeightFields, InnerEdgesOfAFlatMapDoNotCollide) {
  World w(ground(513, 257, [](double, double) { return 1.0; }) + ball(-5, 0.013, 0.5 + 1.0 + 0.1));
  w.run(0.2);
  const Vec3 ahead = Vec3(1, 0.37, 0).normalized();
  w.physics.set_twist(w.body("ball/l"), {ahead, Vec3(-ahead.y(), ahead.x(), 0) / 0.1});
  w.run(4.0);
  const Vec3 at = w.position("ball/l");
  EXPECT_NEAR((at - Vec3(-5, 0.013, 1.6)).dot(ahead), 4.0, 0.02);
  EXPECT_NEAR(at.z(), 1.6, 1e-4);
}

}  // namespace
}  // namespace ruedo::physics::testing
