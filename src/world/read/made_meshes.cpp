// Procedural meshes: prisms over polylines (ear clipping, holes joined by bridges) and heightmaps.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "base/input_file.h"
#include "world/mesh/codecs.h"
#include "world/mesh/mesh_format.h"
#include "world/mesh/picture.h"
#include "world/read/geometry.h"

namespace ruedo::world {
namespace {

using Point = Eigen::Vector2d;
using Polygon = std::vector<Point>;

double cross(const Point& a, const Point& b, const Point& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

double area(const Polygon& p) {
  double twice = 0;
  for (size_t i = 0; i < p.size(); ++i) {
    const Point &a = p[i], &b = p[(i + 1) % p.size()];
    twice += a.x() * b.y() - b.x() * a.y();
  }
  return twice / 2;
}

bool inside(const Point& q, const Polygon& p) {
  bool in = false;
  for (size_t i = 0, j = p.size() - 1; i < p.size(); j = i++) {
    if ((p[i].y() > q.y()) != (p[j].y() > q.y()) &&
        q.x() < (p[j].x() - p[i].x()) * (q.y() - p[i].y()) / (p[j].y() - p[i].y()) + p[i].x()) {
      in = !in;
    }
  }
  return in;
}

// Whether the open segments cross at one point.
bool cross_properly(const Point& a, const Point& b, const Point& c, const Point& d) {
  return cross(a, b, c) * cross(a, b, d) < 0 && cross(c, d, a) * cross(c, d, b) < 0;
}

bool sees(const Point& a, const Point& b, const std::vector<Polygon>& walls) {
  for (const Polygon& wall : walls) {
    for (size_t i = 0; i < wall.size(); ++i) {
      if (cross_properly(a, b, wall[i], wall[(i + 1) % wall.size()])) return false;
    }
  }
  return true;
}

// Joins a hole (clockwise) to the outline (counter-clockwise) with the shortest bridge that crosses
// no edge.
void join_hole(Polygon& outline, const Polygon& hole, const std::vector<Polygon>& walls) {
  double best = std::numeric_limits<double>::infinity();
  size_t best_outer = 0, best_inner = 0;
  for (size_t i = 0; i < outline.size(); ++i) {
    for (size_t k = 0; k < hole.size(); ++k) {
      const double distance = (outline[i] - hole[k]).squaredNorm();
      if (distance < best && sees(outline[i], hole[k], walls)) {
        best = distance;
        best_outer = i;
        best_inner = k;
      }
    }
  }
  if (!std::isfinite(best)) throw std::runtime_error("a hole crosses its outline");
  Polygon joined(outline.begin(), outline.begin() + static_cast<long>(best_outer) + 1);
  for (size_t k = 0; k <= hole.size(); ++k) joined.push_back(hole[(best_inner + k) % hole.size()]);
  joined.insert(joined.end(), outline.begin() + static_cast<long>(best_outer), outline.end());
  outline = std::move(joined);
}

// Triangulates a simple, counter-clockwise polygon (bridges are traversed twice).
std::vector<std::array<Point, 3>> clip_ears(Polygon p) {
  std::vector<std::array<Point, 3>> triangles;
  while (p.size() > 3) {
    bool clipped = false;
    for (size_t i = 0; i < p.size() && !clipped; ++i) {
      const Point &a = p[(i + p.size() - 1) % p.size()], &b = p[i], &c = p[(i + 1) % p.size()];
      const double turn = cross(a, b, c);
      if (turn < 0) continue;
      const bool blocked = turn > 0 && std::any_of(p.begin(), p.end(), [&](const Point& q) {
                             return q != a && q != b && q != c && cross(a, b, q) >= 0 &&
                                    cross(b, c, q) >= 0 && cross(c, a, q) >= 0;
                           });
      if (blocked) continue;
      if (turn > 0) triangles.push_back({a, b, c});
      p.erase(p.begin() + static_cast<long>(i));
      clipped = true;
    }
    if (!clipped) throw std::runtime_error("a polygon crosses itself");
  }
  if (cross(p[0], p[1], p[2]) > 0) triangles.push_back({p[0], p[1], p[2]});
  return triangles;
}

// Opens the polygon, drops repeated points, and checks that it is simple.
void tidy(std::vector<Polygon>& polygons) {
  constexpr size_t kMostPoints = 2000;
  size_t points = 0;
  for (Polygon& p : polygons) {
    if (p.size() > 1 && p.front() == p.back()) p.pop_back();  // closed explicitly
    p.erase(std::unique(p.begin(), p.end()), p.end());
    if (p.size() < 3) throw std::runtime_error("a polygon has less than three points");
    if (std::abs(area(p)) < 1e-12) throw std::runtime_error("a polygon has no area");
    points += p.size();
  }
  if (points > kMostPoints) throw std::runtime_error("it has more than 2000 points");
  for (const Polygon& p : polygons) {
    for (size_t i = 0; i < p.size(); ++i) {
      for (size_t k = i + 2; k < p.size(); ++k) {
        if (cross_properly(p[i], p[i + 1], p[k], p[(k + 1) % p.size()]))
          throw std::runtime_error("a polygon crosses itself");
      }
    }
  }
}

// How many others each polygon is inside of. Even: an outline, made counter-clockwise; odd: a hole
// in the outline around it, made clockwise.
std::vector<int> nest(std::vector<Polygon>& polygons) {
  std::vector<int> depth(polygons.size(), 0);
  for (size_t i = 0; i < polygons.size(); ++i) {
    for (size_t k = 0; k < polygons.size(); ++k)
      depth[i] += k != i && inside(polygons[i][0], polygons[k]);
    const bool counter_clockwise = area(polygons[i]) > 0;
    if (counter_clockwise != (depth[i] % 2 == 0))
      std::reverse(polygons[i].begin(), polygons[i].end());
  }
  return depth;
}

}  // namespace

Mesh extruded(const std::vector<Polygon>& written, double height) {
  std::vector<Polygon> polygons = written;
  tidy(polygons);
  const std::vector<int> depth = nest(polygons);

  Mesh mesh;
  const auto add = [&](const Point& p, double z) {
    mesh.positions.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()),
                                static_cast<float>(z));
    return static_cast<uint32_t>(mesh.positions.size() - 1);
  };
  for (size_t i = 0; i < polygons.size(); ++i) {  // top and bottom
    if (depth[i] % 2) continue;
    Polygon outline = polygons[i];
    for (size_t k = 0; k < polygons.size(); ++k) {
      if (depth[k] == depth[i] + 1 && inside(polygons[k][0], polygons[i]))
        join_hole(outline, polygons[k], polygons);
    }
    for (const auto& t : clip_ears(outline)) {
      mesh.triangles.push_back({add(t[0], height), add(t[1], height), add(t[2], height)});
      mesh.triangles.push_back({add(t[0], 0), add(t[2], 0), add(t[1], 0)});
    }
  }
  for (const Polygon& p : polygons) {  // walls: outward by the direction of the polygons
    for (size_t i = 0; i < p.size(); ++i) {
      const Point &a = p[i], &b = p[(i + 1) % p.size()];
      const uint32_t low_a = add(a, 0), low_b = add(b, 0), high_a = add(a, height),
                     high_b = add(b, height);
      mesh.triangles.push_back({low_a, low_b, high_b});
      mesh.triangles.push_back({low_a, high_b, high_a});
    }
  }
  mesh.parts.push_back({"polyline", 0, static_cast<uint32_t>(mesh.triangles.size()), {}});
  mesh.closed = is_closed(mesh);
  return mesh;
}

namespace {

// Elevations from the lowest (0) to the highest (1). What was not measured is the lowest.
cv::Mat normalized(const cv::Mat& elevation) {
  constexpr float kNoData = -9000.0f;  // m; beyond the deepest sea, by custom
  cv::Mat heights;
  elevation.convertTo(heights, CV_32F);
  float lowest = std::numeric_limits<float>::infinity(), highest = -lowest;
  const auto known = [](float z) { return std::isfinite(z) && z > kNoData && z < -kNoData; };
  for (auto at = heights.begin<float>(); at != heights.end<float>(); ++at) {
    if (!known(*at)) continue;
    lowest = std::min(lowest, *at);
    highest = std::max(highest, *at);
  }
  if (lowest > highest) throw std::runtime_error("it holds no elevation");
  for (auto at = heights.begin<float>(); at != heights.end<float>(); ++at)
    *at = known(*at) && highest > lowest ? (*at - lowest) / (highest - lowest) : 0.0f;
  return heights;
}

}  // namespace

Mesh heightmap(const std::string& picture, const Vec3& size) {
  const std::string bytes = read_input(picture, 64 << 20);
  constexpr int kMost = 1025;
  if (const std::string fault = picture_fault(bytes, kMost); !fault.empty())
    throw std::runtime_error(fault);
  cv::Mat grey;
  try {
    grey = decode_picture(bytes.data(), bytes.size(), cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
  } catch (const cv::Exception&) {
    throw std::runtime_error("the picture is broken");
  }
  if (grey.empty())
    throw std::runtime_error("it is not a picture that can be read (pgm, png, jpeg, bmp, tiff)");
  if (grey.depth() == CV_16S || grey.depth() == CV_32F || grey.depth() == CV_64F)
    grey = normalized(grey);
  else if (grey.depth() != CV_8U && grey.depth() != CV_16U)
    throw std::runtime_error("its pixels are neither of 8 or 16 bits nor floating-point numbers");
  if (grey.cols < 2 || grey.rows < 2 || grey.cols > kMost || grey.rows > kMost) {
    throw std::runtime_error("it has " + std::to_string(grey.cols) + " x " +
                             std::to_string(grey.rows) + " pixels; allowed are 2 to 1025 each way");
  }
  const double white = grey.depth() == CV_8U ? 255.0 : grey.depth() == CV_16U ? 65535.0 : 1.0;
  Mesh mesh;
  mesh.positions.reserve(static_cast<size_t>(grey.cols) * grey.rows);
  // the picture's first row is the one with the largest y
  for (int row = 0; row < grey.rows; ++row) {
    for (int column = 0; column < grey.cols; ++column) {
      const double value = grey.depth() == CV_8U    ? grey.at<uint8_t>(row, column)
                           : grey.depth() == CV_16U ? grey.at<uint16_t>(row, column)
                                                    : grey.at<float>(row, column);
      const double u = static_cast<double>(column) / (grey.cols - 1),
                   v = 1.0 - static_cast<double>(row) / (grey.rows - 1);
      mesh.positions.push_back(
          Vec3((u - 0.5) * size.x(), (v - 0.5) * size.y(), value / white * size.z()).cast<float>());
      mesh.uvs.emplace_back(static_cast<float>(u), static_cast<float>(v));
    }
  }
  for (int row = 0; row + 1 < grey.rows; ++row) {
    for (int column = 0; column + 1 < grey.cols; ++column) {
      const uint32_t a = static_cast<uint32_t>(row * grey.cols + column), b = a + 1,
                     c = a + static_cast<uint32_t>(grey.cols), d = c + 1;
      mesh.triangles.push_back({a, c, b});
      mesh.triangles.push_back({b, c, d});
    }
  }
  mesh.parts.push_back({"heightmap", 0, static_cast<uint32_t>(mesh.triangles.size()), {}});
  return mesh;
}

}  // namespace ruedo::world
