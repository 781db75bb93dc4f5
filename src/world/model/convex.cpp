// GJK in double precision. Contact within a micrometre may count either way: callers keep a margin.
#include "world/model/convex.h"

#include <array>

#include "ruedo/math.h"
#include "world/model/height_grid.h"

namespace ruedo::world {
namespace {

Vec3 support_in_shape(const Geometry& g, const Vec3& d) {
  const auto sign = [](double v) { return v < 0 ? -1.0 : 1.0; };
  const double across = math::hypot(d.x(), d.y());
  const auto rim = [&](double radius) {
    return across > 0 ? Vec3(d.x() / across * radius, d.y() / across * radius, 0)
                      : Vec3(Vec3::Zero());
  };
  switch (g.shape) {
    case Shape::box: return Vec3(sign(d.x()), sign(d.y()), sign(d.z())).cwiseProduct(g.size) / 2;
    case Shape::sphere: return d.normalized() * g.size.x();
    case Shape::ellipsoid: {
      const Vec3 scaled = g.size.cwiseProduct(d);
      return g.size.cwiseProduct(scaled.normalized());
    }
    case Shape::cylinder: return rim(g.size.x()) + Vec3(0, 0, sign(d.z()) * g.size.y() / 2);
    case Shape::capsule:
      return d.normalized() * g.size.x() + Vec3(0, 0, sign(d.z()) * g.size.y() / 2);
    case Shape::cone: {
      const Vec3 apex(0, 0, g.size.y() / 2), base = rim(g.size.x()) - Vec3(0, 0, g.size.y() / 2);
      return apex.dot(d) > base.dot(d) ? apex : base;
    }
    case Shape::mesh: {
      Vec3 best = Vec3::Zero();
      double most = -std::numeric_limits<double>::infinity();
      for_each_vertex(*g.mesh, [&](const Eigen::Vector3f& p) {
        const Vec3 point = g.scale.cwiseProduct(p.cast<double>());
        if (const double along = point.dot(d); along > most) most = along, best = point;
      });
      return best;
    }
    case Shape::plane: break;
  }
  return Vec3::Zero();
}

// The simplex of GJK; the newest point is the last.
struct Simplex {
  std::array<Vec3, 4> p;
  int n = 0;
  void set(std::initializer_list<Vec3> points) {
    n = 0;
    for (const Vec3& each : points) p[n++] = each;
  }
};

// Keeps the part of the simplex nearest to the origin and points `direction` towards the origin.
// True: the origin is inside.
bool reduce(Simplex& s, Vec3& direction) {
  const auto line = [&](const Vec3& a, const Vec3& b) {
    const Vec3 ab = b - a;
    if (ab.dot(-a) > 0) {
      s.set({b, a});
      direction = ab.cross(-a).cross(ab);
      if (direction.squaredNorm() < 1e-24) direction = ab.unitOrthogonal();
    } else {
      s.set({a});
      direction = -a;
    }
  };
  const auto triangle = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 ab = b - a, ac = c - a, normal = ab.cross(ac);
    if (normal.cross(ac).dot(-a) > 0) {
      if (ac.dot(-a) > 0) {
        s.set({c, a});
        direction = ac.cross(-a).cross(ac);
        if (direction.squaredNorm() < 1e-24) direction = ac.unitOrthogonal();
      } else {
        line(a, b);
      }
    } else if (ab.cross(normal).dot(-a) > 0) {
      line(a, b);
    } else if (normal.dot(-a) > 0) {
      s.set({c, b, a});
      direction = normal;
    } else {
      s.set({b, c, a});
      direction = -normal;
    }
  };
  const Vec3 a = s.p[s.n - 1];
  if (s.n == 2) {
    line(a, s.p[0]);
  } else if (s.n == 3) {
    triangle(a, s.p[1], s.p[0]);
  } else if (s.n == 4) {
    const Vec3 b = s.p[2], c = s.p[1], d = s.p[0];
    const Vec3 abc = (b - a).cross(c - a), acd = (c - a).cross(d - a), adb = (d - a).cross(b - a);
    if (abc.dot(-a) > 0)
      triangle(a, b, c);
    else if (acd.dot(-a) > 0)
      triangle(a, c, d);
    else if (adb.dot(-a) > 0)
      triangle(a, d, b);
    else
      return true;
  }
  return false;
}

}  // namespace

Vec3 Convex::support(const Vec3& direction) const {
  if (geometry) return X_WG * support_in_shape(*geometry, X_WG.rotation.conjugate() * direction);
  Vec3 best = points[0];
  for (const Vec3& p : points) {
    if (p.dot(direction) > best.dot(direction)) best = p;
  }
  return best;
}

bool overlap(const Convex& a, const Convex& b) {
  Vec3 direction = Vec3::UnitX();
  Simplex simplex;
  const auto support = [&](const Vec3& d) -> Vec3 { return a.support(d) - b.support(-d); };
  simplex.set({support(direction)});
  direction = -simplex.p[0];
  for (int i = 0; i < 64; ++i) {
    if (direction.squaredNorm() < 1e-18) return true;  // the origin is on the simplex
    const Vec3 point = support(direction.normalized());
    if (point.dot(direction) <= 0) return false;
    simplex.p[simplex.n++] = point;
    if (reduce(simplex, direction)) return true;
  }
  return true;  // no progress: the origin is on the boundary
}

}  // namespace ruedo::world
