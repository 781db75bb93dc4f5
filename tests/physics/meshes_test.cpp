// Floors of triangles: edges that only divide a surface are not felt, edges that stand out are.
#include <filesystem>
#include <fstream>
#include <functional>

#include <gtest/gtest.h>
#include <unistd.h>

#include "world.h"

namespace ruedo::physics::testing {
namespace {

class Meshes : public ::testing::Test {
 protected:
  Meshes()
      : folder_(std::filesystem::temp_directory_path() /
                ("ruedo_meshes_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~Meshes() override { std::filesystem::remove_all(folder_); }

  // Right triangles with legs of 8 cm from (-1, -1) to (7, 1), at the height that `height` says;
  // every vertex as often as it is used.
  std::string floor(const std::function<double(double, double)>& height, double leg = 0.08) {
    const auto path = folder_ / "floor.obj";
    std::ofstream file(path);
    int n = 0;
    const auto corner = [&](double x, double y) {
      file << "v " << x << ' ' << y << ' ' << height(x, y) << '\n';
    };
    for (double x = -1; x < 7; x += leg) {
      for (double y = -1; y < 1; y += leg) {
        for (const auto& [dx, dy] :
             {std::pair(0., 0.), {leg, 0.}, {leg, leg}, {0., 0.}, {leg, leg}, {0., leg}})
          corner(x + dx, y + dy);
        file << "f " << n + 1 << ' ' << n + 2 << ' ' << n + 3 << "\nf " << n + 4 << ' ' << n + 5
             << ' ' << n + 6 << '\n';
        n += 6;
      }
    }
    return "<model name='floor'><static>true</static><link name='l'><collision "
           "name='c'><geometry><mesh><uri>" +
           path.string() + "</uri></mesh></geometry></collision></link></model>";
  }
  std::string flat() {
    return floor([](double, double) { return 0.0; });
  }

  // Rolls a thing of radius 0.1 at 1 m/s along a heading for 4 s.
  static void roll(World& w, double heading, double radius = 0.1) {
    w.run(0.3);
    const Vec3 ahead(std::cos(heading), std::sin(heading), 0);
    w.physics.set_twist(w.body("r/l"), {ahead, Vec3(-ahead.y(), ahead.x(), 0) / radius});
    w.run(4.0);
  }

  std::filesystem::path folder_;
};

TEST_F(Meshes, ABallRollsStraightOverAFlatFloor) {
  for (const int64_t step_us : {1000, 5000, 10'000}) {
    for (const double heading : {0.0, 0.1, -0.2}) {
      World w(flat() + thing("r", "0.013 0.007 0.1 0 0 0", kBall, 1, 1.0, 0.004), step_us);
      roll(w, heading);
      const Vec3 way = w.position("r/l") - Vec3(0.013, 0.007, 0.1);
      EXPECT_NEAR(way.x(), 4 * std::cos(heading), 0.01) << step_us << " " << heading;
      EXPECT_NEAR(way.y(), 4 * std::sin(heading), 0.005) << step_us << " " << heading;
      EXPECT_NEAR(w.physics.twist(w.body("r/l")).linear.norm(), 1.0, 2e-3)
          << step_us << " " << heading;
    }
  }
}

TEST_F(Meshes, ALyingCylinderKeepsItsSpeed) {
  for (const int64_t step_us : {1000, 5000, 10'000}) {
    World w(flat() + thing("r", "0.013 0.007 0.1 1.5707963267948966 0 0",
                           "<cylinder><radius>0.1</radius><length>0.3</length></cylinder>", 1, 1.0,
                           0.005),
            step_us);
    roll(w, 0.0);
    EXPECT_NEAR(w.position("r/l").x(), 4.013, 0.02) << step_us;
    EXPECT_NEAR(w.position("r/l").y(), 0.007, 0.02) << step_us;
    EXPECT_NEAR(w.physics.twist(w.body("r/l")).linear.x(), 1.0, 0.01) << step_us;
  }
}

// A box slides v^2 / (2 mu g), as on a plane.
TEST_F(Meshes, ABoxSlidesAsOnAPlane) {
  World w(flat() + thing("b", "0.013 0.007 0.1 0 0 0.3", kBox, 1, 0.4), 5000);
  w.run(0.3);
  const Vec3 start = w.position("b/l");
  w.physics.set_twist(w.body("b/l"), {{2, 0, 0}, Vec3::Zero()});
  w.run(2.0);
  EXPECT_NEAR(w.position("b/l").x() - start.x(), 4.0 / (2 * 0.4 * 10), 0.01);
  EXPECT_NEAR(w.position("b/l").y(), start.y(), 2e-3);
  EXPECT_NEAR(w.position("b/l").z(), 0.1, 1e-3);
}

// A kerb of 8 cm across the way: the ball comes back, or stays in front of it.
TEST_F(Meshes, AnEdgeThatStandsOutIsFelt) {
  World w(floor([](double x, double) { return x > 1.9 ? 0.08 : 0.0; }) +
              thing("r", "0.013 0.007 0.1 0 0 0", kBall, 1, 1.0, 0.004),
          5000);
  roll(w, 0.0);
  EXPECT_LT(w.position("r/l").x(), 1.9);
}

// Into a valley of 0.2 rad and out of it: the crease costs nothing except what the change of the
// velocity's direction takes.
TEST_F(Meshes, ARidgeCarries) {
  // A ridge along x: a ball on top of it rests on its edge alone.
  World w(floor([](double, double y) { return -std::abs(y - 0.04) * 0.5; }, 0.08) +
              thing("r", "1 0.04 0.1 0 0 0", kBall, 1, 1.0, 0.004),
          5000);
  w.run(0.2);
  EXPECT_NEAR(w.position("r/l").z(), 0.1, 2e-3);
}

}  // namespace
}  // namespace ruedo::physics::testing
