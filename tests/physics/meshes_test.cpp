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
TEST_F(Meshes, AnOuterEdgeCollides) {
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

class Hollow : public Meshes {
 protected:
  // A body of revolution about z with that many sides: a closed outline of (r, z),
  // counter-clockwise with z up and r to the right; it may begin and end on the axis. Returns its
  // file.
  std::string turned(const std::vector<std::pair<double, double>>& outline, int sides) {
    const auto path = folder_ / "turned.obj";
    std::ofstream file(path);
    file.precision(9);
    for (const auto& [r, z] : outline) {
      for (int k = 0; k < sides; ++k)
        file << "v " << r * std::cos(2 * M_PI * k / sides) << ' '
             << r * std::sin(2 * M_PI * k / sides) << ' ' << z << '\n';
    }
    const int rings = static_cast<int>(outline.size());
    for (int i = 0; i < rings; ++i) {
      const int next = (i + 1) % rings;
      for (int k = 0; k < sides; ++k) {
        const int a = i * sides + k + 1, b = i * sides + (k + 1) % sides + 1,
                  c = next * sides + (k + 1) % sides + 1, d = next * sides + k + 1;
        if (outline[i].first > 0) file << "f " << a << ' ' << b << ' ' << d << '\n';
        if (outline[next].first > 0) file << "f " << b << ' ' << c << ' ' << d << '\n';
      }
    }
    return path.string();
  }
  // Of 80 mm across, 100 mm high, with walls and a floor of 3 mm.
  std::string cup(int sides) {
    return turned({{0, 0}, {.04, 0}, {.04, .1}, {.037, .1}, {.037, .003}, {0, .003}}, sides);
  }
  static std::string mesh(const std::string& file, const std::string& optimization = "",
                          double scale = 1) {
    const std::string s = std::to_string(scale);
    return "<mesh" + (optimization.empty() ? "" : " optimization='" + optimization + "'") +
           "><uri>" + file + "</uri><scale>" + s + ' ' + s + ' ' + s + "</scale></mesh>";
  }
  static std::string ball(double radius, double height) {
    return thing("ball", "0.003 0.002 " + std::to_string(height) + " 0 0 0",
                 "<sphere><radius>" + std::to_string(radius) + "</radius></sphere>", 0.05, 0.5,
                 0.02 * radius * radius);
  }
};

TEST_F(Hollow, ACupHoldsABall) {
  for (const double scale : {0.5, 1.0, 10.0}) {
    for (const auto& [sides, optimization] :
         {std::pair(12, ""), {33, ""}, {32, "convex_decomposition"}}) {
      for (const int64_t step_us : {1000, 5000, 20'000}) {
        World w(kPlane +
                    thing("cup", "0 0 0 0 0 0", mesh(cup(sides), optimization, scale), 0.2, 0.5,
                          5e-4 * scale * scale) +
                    ball(0.025 * scale, 0.13 * scale),
                step_us);
        w.run(2.0);
        const Vec3 there = w.position("ball/l") - w.position("cup/l");
        EXPECT_NEAR(there.z(), (0.003 + 0.025) * scale, 1e-3) << scale << sides << step_us;
        EXPECT_LT(std::hypot(there.x(), there.y()), 0.012 * scale) << scale << sides << step_us;
        EXPECT_NEAR(w.position("cup/l").z(), 0.0, 1e-3) << scale << sides << step_us;
      }
    }
  }
}

TEST_F(Hollow, UsesTheHullIfTheFileRequestsIt) {
  World w(kPlane + thing("cup", "0 0 0 0 0 0", mesh(cup(12), "convex_hull"), 0.2, 0.5, 5e-4) +
              ball(0.025, 0.13),
          5000);
  w.run(2.0);
  EXPECT_NEAR(w.position("ball/l").z(), 0.125, 1e-3);
}

// A ring falls over a post.
TEST_F(Hollow, ARingFallsOverAPost) {
  const std::string ring = turned({{.05, -.01}, {.07, -.01}, {.07, .01}, {.05, .01}}, 24);
  World w(kPlane + thing("ring", "0 0 0.3 0 0 0", mesh(ring), 0.2, 0.5, 5e-4) +
              thing("post", "0 0 0.1 0 0 0",
                    "<cylinder><radius>0.03</radius><length>0.2</length></cylinder>", 0),
          5000);
  w.run(2.0);
  EXPECT_NEAR(w.position("ring/l").z(), 0.01, 1e-3);
}

}  // namespace
}  // namespace ruedo::physics::testing
