// Footprints of shapes whose outline is known.
#include "world/model/footprint.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "text_world.h"

namespace ruedo::world {
namespace {

Footprint of(const std::string& collisions) {
  const auto world =
      world_of("<model name='m'><link name='base'>" + collisions + "</link></model>");
  return footprint(*world->models.front().model);
}

std::string collision(const std::string& name, const std::string& pose, const std::string& shape) {
  return "<collision name='" + name + "'><pose>" + pose + "</pose><geometry>" + shape +
         "</geometry></collision>";
}

void expect_corners(const Footprint& found, const std::vector<Eigen::Vector2d>& corners) {
  ASSERT_EQ(found.corners.size(), corners.size());
  for (const Eigen::Vector2d& corner : corners) {
    const bool is_there =
        std::any_of(found.corners.begin(), found.corners.end(),
                    [&](const Eigen::Vector2d& each) { return (each - corner).norm() < 1e-9; });
    EXPECT_TRUE(is_there) << corner.transpose();
  }
}

TEST(Footprint, OfABoxIsItsRectangle) {
  const Footprint found =
      of(collision("c", "0.1 0 0.2 0 0 0", "<box><size>0.6 0.4 0.3</size></box>"));
  expect_corners(found, {{0.4, 0.2}, {-0.2, 0.2}, {-0.2, -0.2}, {0.4, -0.2}});
  EXPECT_NEAR(found.radius, std::hypot(0.4, 0.2), 1e-12);
  EXPECT_FALSE(found.is_round);
}

TEST(Footprint, OfADiscIsItsCircle) {
  const Footprint found = of(collision(
      "c", "0 0 0.1 0 0 0", "<cylinder><radius>0.2</radius><length>0.1</length></cylinder>"));
  EXPECT_NEAR(found.radius, 0.2, 1e-12);
  EXPECT_TRUE(found.is_round);
  EXPECT_EQ(found.corners.size(), 8u);
  for (const Eigen::Vector2d& corner : found.corners)
    EXPECT_NEAR(corner.norm(), 0.2 / std::cos(std::numbers::pi / 8), 1e-9);
}

TEST(Footprint, OfABoxThatIsTurnedHasItsOwnCornersCut) {
  // A square of side s at 45 degrees is that octagon with four sides of length 0.
  const Footprint found =
      of(collision("c", "0 0 0 0 0 0.78539816339744831", "<box><size>0.2 0.2 1</size></box>"));
  const double r = 0.1 * std::numbers::sqrt2;
  expect_corners(found, {{r, 0}, {0, r}, {-r, 0}, {0, -r}});
}

TEST(Footprint, OfNothingIsEmpty) {
  const Footprint found = of(collision("c", "0 0 0 0 0 0", "<plane/>"));
  EXPECT_TRUE(found.corners.empty());
  EXPECT_EQ(found.radius, 0.0);
}

}  // namespace
}  // namespace ruedo::world
