// Convex pieces of meshes: their number and volume, against points that are inside by the formula
// of the body.
#include <algorithm>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "world/convex/convex_pieces.h"

namespace ruedo::world {
namespace {

using Eigen::Vector3d;

struct Solid {
  std::vector<Vector3d> positions;
  std::vector<std::array<uint32_t, 3>> triangles;
  double volume = 0.0;
  std::function<bool(const Vector3d&)> has;
  Vector3d low, high;

  std::vector<ConvexPiece> divided(size_t most = 64) const {
    return convex_pieces(positions, triangles, most);
  }
  void quad(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    triangles.push_back({a, b, c});
    triangles.push_back({a, c, d});
  }
};

using Outline = std::vector<std::pair<double, double>>;  // r, z, counter-clockwise

// The distance from the axis in units of the polygon's circumscribed circle.
double polygon_radius(double x, double y, int sides) {
  const double half = M_PI / sides;
  const double angle = std::fmod(std::atan2(y, x) + 2 * M_PI, 2 * half);
  return std::hypot(x, y) * std::cos(angle - half) / std::cos(half);
}

// A regular prism or body of revolution: every ring of the outline is a polygon.
Solid turned(const Outline& outline, int sides) {
  Solid solid;
  for (const auto& [r, z] : outline) {
    for (int k = 0; k < sides; ++k)
      solid.positions.emplace_back(r * std::cos(2 * M_PI * k / sides),
                                   r * std::sin(2 * M_PI * k / sides), z);
  }
  double twice = 0.0;  // the integral of r^2 over the outline's area is volume / pi, in the limit
  const auto rings = static_cast<uint32_t>(outline.size());
  const auto n = static_cast<uint32_t>(sides);
  for (uint32_t i = 0; i < rings; ++i) {
    const uint32_t next = (i + 1) % rings;
    const auto& [r1, z1] = outline[i];
    const auto& [r2, z2] = outline[next];
    twice += (z2 - z1) * (r1 * r1 + r1 * r2 + r2 * r2) / 3;
    for (uint32_t k = 0; k < n; ++k) {
      const uint32_t a = i * n + k, b = i * n + (k + 1) % n;
      const uint32_t c = next * n + (k + 1) % n, d = next * n + k;
      if (r1 > 0) solid.triangles.push_back({a, b, d});
      if (r2 > 0) solid.triangles.push_back({b, c, d});
    }
  }
  solid.volume = twice * sides / 2 * std::sin(2 * M_PI / sides);  // a polygon for the circle
  solid.has = [outline, sides, rings](const Vector3d& p) {
    const double r = polygon_radius(p.x(), p.y(), sides);
    bool inside = false;
    for (uint32_t i = 0; i < rings; ++i) {
      const auto& [r1, z1] = outline[i];
      const auto& [r2, z2] = outline[(i + 1) % rings];
      if ((z1 > p.z()) != (z2 > p.z()) && r < r1 + (p.z() - z1) / (z2 - z1) * (r2 - r1))
        inside = !inside;
    }
    return inside;
  };
  return solid;
}

Solid box(const Vector3d& low, const Vector3d& high) {
  Solid solid;
  for (const double z : {low.z(), high.z()}) {
    for (const auto& [x, y] : {std::pair(low.x(), low.y()),
                               {high.x(), low.y()},
                               {high.x(), high.y()},
                               {low.x(), high.y()}})
      solid.positions.emplace_back(x, y, z);
  }
  solid.quad(3, 2, 1, 0);
  solid.quad(4, 5, 6, 7);
  for (uint32_t k = 0; k < 4; ++k) solid.quad(k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4);
  solid.volume = (high - low).prod();
  return solid;
}

double volume(const ConvexPiece& piece) {
  double six = 0.0;
  for (const auto& t : piece.triangles)
    six += piece.corners[t[0]].dot(piece.corners[t[1]].cross(piece.corners[t[2]]));
  return six / 6;
}

bool has(const ConvexPiece& piece, const Vector3d& p) {
  return std::all_of(piece.triangles.begin(), piece.triangles.end(), [&](const auto& t) {
    const Vector3d &a = piece.corners[t[0]], &b = piece.corners[t[1]], &c = piece.corners[t[2]];
    return (b - a).cross(c - a).dot(p - a) <= 1e-12;
  });
}

const Outline kCup = {{0, 0}, {.04, 0}, {.04, .1}, {.037, .1}, {.037, .003}, {0, .003}};
const Outline kTapered = {{0, 0}, {.03, 0}, {.04, .1}, {.037, .1}, {.027, .003}, {0, .003}};
const Outline kTube = {{.037, 0}, {.04, 0}, {.04, .1}, {.037, .1}};
const Outline kGroove = {{.02, 0},   {.05, 0},   {.05, .01}, {.03, .01},
                         {.03, .03}, {.05, .03}, {.05, .04}, {.02, .04}};

TEST(ConvexPieces, HaveTheVolumeOfTheMesh) {
  for (const Outline& outline : {kCup, kTapered, kTube, kGroove}) {
    for (const int sides : {8, 24, 33, 64}) {
      const Solid solid = turned(outline, sides);
      const auto pieces = solid.divided();
      double sum = 0.0;
      for (const ConvexPiece& piece : pieces) sum += volume(piece);
      EXPECT_LE(pieces.size(), 64u) << sides;
      EXPECT_GT(sum, solid.volume * (1 - 1e-4)) << sides;
      EXPECT_LT(sum, solid.volume * 1.05) << sides;
    }
  }
}

// Of random points in the bounding box, nearly the same are inside of a piece as inside of the
// body: nothing of the body is missing, and the hollow is empty.
TEST(ConvexPieces, HaveTheShapeOfTheMesh) {
  for (const Outline& outline : {kCup, kTapered, kTube, kGroove}) {
    const Solid solid = turned(outline, 32);
    const auto pieces = solid.divided();
    int in_body = 0, missing = 0, more = 0;
    uint64_t state = 1;
    const auto random = [&state] {
      state = state * 6364136223846793005ull + 1442695040888963407ull;
      return static_cast<double>(state >> 11) * 0x1p-53;
    };
    for (int i = 0; i < 40'000; ++i) {
      const Vector3d p(0.05 * (2 * random() - 1), 0.05 * (2 * random() - 1), 0.1 * random());
      const bool in = solid.has(p);
      const bool in_pieces = std::any_of(pieces.begin(), pieces.end(),
                                         [&](const ConvexPiece& each) { return has(each, p); });
      in_body += in;
      missing += in && !in_pieces;
      more += !in && in_pieces;
    }
    EXPECT_LT(missing, 0.002 * in_body);
    EXPECT_LT(more, 0.06 * in_body);
  }
}

TEST(ConvexPieces, AreAsFewAsTheBodyNeeds) {
  // An open box: five plates.
  Solid bin = box({-.1, -.08, 0}, {.1, .08, .1});
  const Solid hollow = box({-.096, -.076, .004}, {.096, .076, .1});
  bin.triangles.erase(bin.triangles.begin() + 2, bin.triangles.begin() + 4);  // the lid
  for (const Vector3d& p : hollow.positions) bin.positions.push_back(p);
  for (size_t i = 0; i < hollow.triangles.size(); ++i) {
    const auto& t = hollow.triangles[i];
    if (i != 2 && i != 3) bin.triangles.push_back({t[0] + 8, t[2] + 8, t[1] + 8});
  }
  for (uint32_t k = 0; k < 4; ++k) bin.quad(4 + k, 4 + (k + 1) % 4, 12 + (k + 1) % 4, 12 + k);
  const auto pieces = bin.divided();
  EXPECT_EQ(pieces.size(), 5u);
  double sum = 0.0;
  for (const ConvexPiece& piece : pieces) sum += volume(piece);
  EXPECT_NEAR(sum / (.2 * .16 * .1 - .192 * .152 * .096), 1.0, 1e-3);
}

TEST(ConvexPieces, LeaveConvexAndOpenMeshesUndivided) {
  EXPECT_TRUE(box({0, 0, 0}, {1, 2, 3}).divided().empty());
  Solid two = box({0, 0, 0}, {1, 1, 1});
  const Solid other = box({3, 0, 0}, {4, 1, 1});
  for (const auto& t : other.triangles) two.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  two.positions.insert(two.positions.end(), other.positions.begin(), other.positions.end());
  EXPECT_TRUE(two.divided().empty());
  const auto one = two.divided(1);  // the file allows only one
  ASSERT_EQ(one.size(), 1u);
  EXPECT_NEAR(volume(one[0]), 4.0, 1e-3);
  Solid open = turned(kCup, 12);
  open.triangles.pop_back();
  EXPECT_TRUE(open.divided().empty());
}

TEST(ConvexPieces, AreNoMoreThanAllowed) {
  const Solid cup = turned(kCup, 32);
  for (const size_t most : {1u, 2u, 7u, 16u}) EXPECT_LE(cup.divided(most).size(), most);
}

// A cavity without an opening stays one.
TEST(ConvexPieces, LeaveACavity) {
  Solid hollow = box({0, 0, 0}, {1, 1, 1});
  const Solid cavity = box({.1, .1, .1}, {.9, .9, .9});
  for (const auto& t : cavity.triangles) hollow.triangles.push_back({t[0] + 8, t[2] + 8, t[1] + 8});
  hollow.positions.insert(hollow.positions.end(), cavity.positions.begin(), cavity.positions.end());
  double sum = 0.0;
  const auto pieces = hollow.divided();
  for (const ConvexPiece& piece : pieces) {
    sum += volume(piece);
    EXPECT_FALSE(has(piece, {.5, .5, .5}));
  }
  EXPECT_NEAR(sum / (1 - .512), 1.0, 0.05);
}

}  // namespace
}  // namespace ruedo::world
