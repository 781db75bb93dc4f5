// Geodesy on an ellipsoid of revolution.
#include "sensors/geodesy.h"

#include <cmath>

#include "ruedo/math.h"

namespace ruedo {

Eigen::Matrix3d east_north_up(double latitude, double longitude) {
  const double sb = math::sin(latitude), cb = math::cos(latitude);
  const double sl = math::sin(longitude), cl = math::cos(longitude);
  Eigen::Matrix3d R;
  R << -sl, -sb * cl, cb * cl,  //
      cl, -sb * sl, cb * sl,    //
      0, cb, sb;
  return R;
}

Globe::Globe(const world::Environment& environment)
    : a_(environment.equatorial_radius),
      b_(environment.polar_radius),
      e2_(1.0 - (b_ / a_) * (b_ / a_)),
      origin_(
          to_ecef(Geodetic{environment.latitude, environment.longitude, environment.elevation})) {
  const double s = math::sin(environment.heading), c = math::cos(environment.heading);
  Eigen::Matrix3d turned;  // world to east, north, up
  turned << c, -s, 0, s, c, 0, 0, 0, 1;
  R_EW_ = east_north_up(environment.latitude, environment.longitude) * turned;
}

Vec3 Globe::to_ecef(const Geodetic& place) const {
  const double s = math::sin(place.latitude), c = math::cos(place.latitude);
  const double n = a_ / std::sqrt(1.0 - e2_ * s * s);  // radius of curvature in the prime vertical
  return {(n + place.altitude) * c * math::cos(place.longitude),
          (n + place.altitude) * c * math::sin(place.longitude),
          ((1.0 - e2_) * n + place.altitude) * s};
}

Geodetic Globe::from_ecef(const Vec3& p) const {
  constexpr int kIterations = 4;  // each gains at least three digits; six near the surface
  const double rho = math::hypot(p.x(), p.y()), z = p.z();
  const double second_e2 = (a_ / b_) * (a_ / b_) - 1.0;
  double beta = math::atan2(a_ * z, b_ * rho), latitude = 0.0;  // parametric and geodetic latitude
  for (int i = 0; i < kIterations; ++i) {
    const double s = math::sin(beta), c = math::cos(beta);
    latitude = math::atan2(z + second_e2 * b_ * s * s * s, rho - e2_ * a_ * c * c * c);
    beta = math::atan2(b_ * math::sin(latitude), a_ * math::cos(latitude));
  }
  const double s = math::sin(latitude), c = math::cos(latitude);
  const double w = std::sqrt(1.0 - e2_ * s * s);
  // The formula for the height that is exact at the poles and at the equator.
  return {latitude, math::atan2(p.y(), p.x()), rho * c + z * s - a_ * w};
}

Geodetic Globe::geodetic(const Vec3& p_W) const { return from_ecef(to_ecef(p_W)); }

Vec3 Globe::east_north_up_at(const Geodetic& place, const Vec3& v_W) const {
  return east_north_up(place.latitude, place.longitude).transpose() * (R_EW_ * v_W);
}

}  // namespace ruedo
