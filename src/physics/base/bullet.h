// Bullet's headers in double precision, and conversions between its types and ours. Only for the
// sources of src/physics.
#pragma once

// gcc sees an uninitialised vector in btBoxShape::getPlane that is assigned before it is read.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#include <btBulletDynamicsCommon.h>
#pragma GCC diagnostic pop

#include "ruedo/pose.h"

// Without BT_USE_DOUBLE_PRECISION, Bullet's headers would still compile, but break at run time.
static_assert(sizeof(btScalar) == 8, "Bullet must be used in double precision");

namespace ruedo::physics {

inline btVector3 to_bt(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline btQuaternion to_bt(const Quat& q) { return {q.x(), q.y(), q.z(), q.w()}; }
inline btTransform to_bt(const Pose& X) {
  return btTransform(to_bt(X.rotation), to_bt(X.translation));
}

inline Vec3 from_bt(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline Quat from_bt(const btQuaternion& q) { return {q.w(), q.x(), q.y(), q.z()}; }
inline Pose from_bt(const btTransform& X) {
  return {from_bt(X.getRotation()), from_bt(X.getOrigin())};
}

// The length (s) of the substep that a contact point's impulses are of; 0: it has none yet. It lies
// in a field of Bullet's own solver, which does not run here.
inline btScalar& substep_of(btManifoldPoint& point) { return point.m_prevRHS; }
inline btScalar substep_of(const btManifoldPoint& point) { return point.m_prevRHS; }

}  // namespace ruedo::physics
