// Converts between the world's frame and positions on an ellipsoid, through earth-centred,
// earth-fixed coordinates (ECEF); no flat-earth approximation.
//
// Geodetic to ECEF is a closed form; the inverse uses Bowring's iteration for the parametric
// latitude ("Transformation from spatial to geographical coordinates", Survey Review 23 (1976)
// 323), to rounding precision.
#pragma once

#include "world/model/world_model.h"

namespace ruedo {

struct Geodetic {
  double latitude = 0.0, longitude = 0.0;  // rad
  double altitude = 0.0;                   // m above the ellipsoid
};

// East, north and up at a position, as the columns of the rotation to ECEF.
Eigen::Matrix3d east_north_up(double latitude, double longitude);

class Globe {
 public:
  explicit Globe(const world::Environment& environment);

  Vec3 to_ecef(const Geodetic& place) const;
  Geodetic from_ecef(const Vec3& p) const;

  Geodetic geodetic(const Vec3& p_W) const;  // of a point in the world
  // A vector in the world, expressed in east, north and up at a position.
  Vec3 east_north_up_at(const Geodetic& place, const Vec3& v_W) const;
  // The inverse, in the world's axes.
  Vec3 in_world(const Vec3& v_ecef) const { return R_EW_.transpose() * v_ecef; }
  Vec3 to_ecef(const Vec3& p_W) const { return origin_ + R_EW_ * p_W; }

 private:
  double a_, b_, e2_;  // m, m, first eccentricity squared
  Vec3 origin_;        // ECEF
  Eigen::Matrix3d R_EW_;
};

}  // namespace ruedo
