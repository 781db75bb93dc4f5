// Prisms over polylines: ear clipping, holes joined by bridges.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "world/mesh/mesh_format.h"
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

}  // namespace ruedo::world
