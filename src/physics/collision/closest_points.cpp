// GJK: descends on the difference A - B of the cores towards the origin, with a simplex of at most
// four of its points.
#include "physics/collision/closest_points.h"

#include <algorithm>
#include <array>

namespace ruedo::physics {

namespace {

constexpr double kTolerance_m = 1e-7;  // the distance is known so well
constexpr double kOverlap_m = 1e-9;    // the origin counts as inside
constexpr double kFlat = 1e-20;        // sine squared of the angle in a triangle without an inside
constexpr int kMostRounds = 200;       // smooth shapes take about 20, polyhedra fewer

struct Corner {
  btVector3 w, a, b;  // w = a - b, a point of A and one of B
};

// Some corners, and the point of their hull that is nearest to the origin.
struct Simplex {
  std::array<Corner, 4> corners;
  std::array<double, 4> weights{};  // of the corners, for that point; they add up to 1
  size_t size = 0;
  btVector3 nearest{0, 0, 0};
  bool inside = false;  // the origin

  void take(std::initializer_list<std::pair<const Corner*, double>> weighted) {
    size = 0;
    nearest.setZero();
    for (const auto& [corner, weight] : weighted) {
      corners[size] = *corner;
      weights[size++] = weight;
      nearest += corner->w * weight;
    }
  }
  const Simplex& nearer(const Simplex& other) const {
    return other.nearest.length2() < nearest.length2() ? other : *this;
  }
  btVector3 on_a() const {
    btVector3 sum(0, 0, 0);
    for (size_t i = 0; i < size; ++i) sum += corners[i].a * weights[i];
    return sum;
  }
};

Simplex reduced(const Corner& a, const Corner& b) {
  const btVector3 ab = b.w - a.w;
  const double along = -a.w.dot(ab), whole = ab.length2();
  Simplex simplex;
  if (along <= 0.0 || whole <= 0.0) {
    simplex.take({{&a, 1.0}});
  } else if (along >= whole) {
    simplex.take({{&b, 1.0}});
  } else {
    simplex.take({{&a, 1.0 - along / whole}, {&b, along / whole}});
  }
  return simplex;
}

Simplex reduced(const Corner& a, const Corner& b, const Corner& c) {
  const btVector3 ab = b.w - a.w, ac = c.w - a.w, normal = ab.cross(ac);
  const double area = normal.length2();
  if (area > kFlat * ab.length2() * ac.length2()) {
    const double of_a = normal.dot(b.w.cross(c.w)), of_b = normal.dot(c.w.cross(a.w)),
                 of_c = normal.dot(a.w.cross(b.w));
    if (of_a >= 0.0 && of_b >= 0.0 && of_c >= 0.0) {
      Simplex simplex;
      simplex.take({{&a, of_a / area}, {&b, of_b / area}, {&c, of_c / area}});
      simplex.nearest = normal * (normal.dot(a.w) / area);  // better than the sum, where it is far
      return simplex;
    }
  }
  return reduced(a, b).nearer(reduced(b, c)).nearer(reduced(c, a));
}

double volume(const btVector3& a, const btVector3& b, const btVector3& c) {
  return a.dot(b.cross(c));
}

Simplex reduced(const Corner& a, const Corner& b, const Corner& c, const Corner& d) {
  const double whole = volume(b.w - a.w, c.w - a.w, d.w - a.w);
  const double sign = whole < 0.0 ? -1.0 : 1.0;
  const bool inside = whole != 0.0 && sign * volume(b.w, c.w, d.w) >= 0.0 &&
                      sign * volume(a.w, d.w, c.w) >= 0.0 && sign * volume(a.w, b.w, d.w) >= 0.0 &&
                      sign * volume(a.w, c.w, b.w) >= 0.0;
  Simplex simplex =
      reduced(a, b, c).nearer(reduced(a, b, d)).nearer(reduced(a, c, d)).nearer(reduced(b, c, d));
  simplex.inside = inside;
  return simplex;
}

Simplex reduced(const Simplex& s, const Corner& more) {
  const auto& c = s.corners;
  switch (s.size) {
    case 0: return reduced(more, more);
    case 1: return reduced(c[0], more);
    case 2: return reduced(c[0], c[1], more);
    default: return reduced(c[0], c[1], c[2], more);
  }
}

Corner farthest(const PlacedShape& a, const PlacedShape& b, const btVector3& direction) {
  const auto of = [](const PlacedShape& s, const btVector3& d) {
    return s.X * s.shape.localGetSupportingVertexWithoutMargin(d * s.X.getBasis());
  };
  const btVector3 on_a = of(a, direction), on_b = of(b, -direction);
  return {on_a - on_b, on_a, on_b};
}

}  // namespace

ClosestPoints closest_points(const PlacedShape& a, const PlacedShape& b, double reach) {
  const double margin_a = a.shape.getMargin(), margin_b = b.shape.getMargin();
  ClosestPoints closest;
  Simplex simplex;
  btVector3 normal = a.X.getOrigin() - b.X.getOrigin();
  double length = normal.length();
  normal = length > kOverlap_m ? normal / length : btVector3(1, 0, 0);
  for (int round = 0; round < kMostRounds; ++round) {
    const Corner corner = farthest(a, b, -normal);
    const double at_least = normal.dot(corner.w);  // A - B is beyond that plane
    if (at_least > reach + margin_a + margin_b) return closest;
    if (simplex.size > 0 && length - at_least <= kTolerance_m) break;
    const Simplex next = reduced(simplex, corner);
    const double next_length = next.nearest.length();
    if (next.inside || next_length <= kOverlap_m) {
      closest.distance = 0.0;
      closest.on_a = closest.on_b = next.on_a();
      return closest;
    }
    if (simplex.size > 0 && next_length >= length) break;  // no better within rounding
    simplex = next;
    length = next_length;
    normal = simplex.nearest / length;
  }
  const double distance = length - margin_a - margin_b;
  if (distance > reach) return closest;
  closest.distance = std::max(distance, 0.0);
  closest.normal = normal;
  closest.on_a = simplex.on_a() - normal * margin_a;
  closest.on_b = closest.on_a - normal * distance;
  return closest;
}

}  // namespace ruedo::physics
