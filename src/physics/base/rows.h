// Bodies and rows of the constraint solver. A row prescribes a linear combination of two bodies'
// velocities, and has the impulse that achieves it.
#pragma once

#include <cmath>
#include <vector>

#include "physics/base/bullet.h"

namespace ruedo::physics {

// Of a vector in a plane. hypot would cost ten times as much, to allow for parts that are huge.
inline double length_of(double x, double y) { return std::sqrt(x * x + y * y); }

struct SolverBody {
  btRigidBody* bullet = nullptr;            // null: immovable
  Vec3 v = Vec3::Zero(), w = Vec3::Zero();  // of the centre of mass, m/s and rad/s, world
  Vec3 push_v = Vec3::Zero(),
       // pseudo-velocities that correct position errors, and are then discarded
      push_w = Vec3::Zero();
  Vec3 v0 = Vec3::Zero(), w0 = Vec3::Zero();                  // before forces acted
  Vec3 inverse_mass = Vec3::Zero();                           // 1/kg, along each axis of the world
  Eigen::Matrix3d inverse_inertia = Eigen::Matrix3d::Zero();  // world
  bool held = false;  // a row acted on it, or it has a joint
  // Of a mechanism, where moments of inertia differ: its rotation before the substep, and by how
  // much its angular momentum changes in the first half of it (N m s, world), as last found.
  bool swings = false;
  Quat before = Quat::Identity();
  Vec3 swing = Vec3::Zero(), next_swing = Vec3::Zero();
};
// Drives or brakes a joint about or along one axis, in addition to Bullet's constraint.
struct JointMotor {
  bool on = false, linear = false;
  Vec3 axis = Vec3::UnitZ(), anchor = Vec3::Zero();  // world; positive motion of the child
  double advance = 0.0;  // m/rad, linear: a thread's advance, which the rate does not include
  // For a gearbox: the rate is the child's about the axis plus the parent's about this one, both
  // relative to the reference, which bears the remaining moments.
  Vec3 parent_axis = Vec3::Zero();
  btRigidBody* reference = nullptr;
  double rate = 0.0;                // rad/s or m/s
  double lower = 0.0, upper = 0.0;  // impulse per substep, N m s or N s
  double softness = 0.0;            // rate lost per impulse: 1 / (gain * substep)
  double impulse = 0.0;             // the impulse that it gave
};
struct JointMotors {
  JointMotor first, second;  // second: universal joints, screws, and the friction beside a servo
  // For the damping about or along the axes of those two: rate 0, soft, without bounds.
  JointMotor damper, second_damper;
};

using SolverBodies = std::vector<SolverBody>;  // the first one is immovable

struct Row {
  int a = 0, b = 0;
  Vec3 linear_a = Vec3::Zero(), angular_a = Vec3::Zero(), linear_b = Vec3::Zero(),
       angular_b = Vec3::Zero();  // J
  Vec3 moves_a = Vec3::Zero(), turns_a = Vec3::Zero(), moves_b = Vec3::Zero(),
       turns_b = Vec3::Zero();  // M^-1 J^T
  double response = 0.0;        // J M^-1 J^T: velocity change per unit impulse
  double softness = 0.0;        // of the row: J v + softness * impulse = target
  double inverse = 0.0;         // 1 / (response + softness); 0: immovable
  double target = 0.0, lower = 0.0, upper = 0.0, impulse = 0.0;
  double push_target = 0.0, push = 0.0;
  // impulse before and search direction, for the conjugate directions
  double before = 0.0, heading = 0.0;

  // To be called once bodies, Jacobian and softness are set.
  void prepare(const SolverBodies& bodies) {
    const SolverBody& A = bodies[a];
    const SolverBody& B = bodies[b];
    moves_a = A.inverse_mass.cwiseProduct(linear_a);
    turns_a = A.inverse_inertia * angular_a;
    moves_b = B.inverse_mass.cwiseProduct(linear_b);
    turns_b = B.inverse_inertia * angular_b;
    response = linear_a.dot(moves_a) + angular_a.dot(turns_a) + linear_b.dot(moves_b) +
               angular_b.dot(turns_b);
    inverse = response > 1e-12 ? 1.0 / (response + softness) : 0.0;
  }
  // The velocity change of another row due to an impulse of this one.
  double coupling(const Row& other) const {
    double sum = 0.0;
    if (a == other.a) sum += linear_a.dot(other.moves_a) + angular_a.dot(other.turns_a);
    if (a == other.b) sum += linear_a.dot(other.moves_b) + angular_a.dot(other.turns_b);
    if (b == other.a) sum += linear_b.dot(other.moves_a) + angular_b.dot(other.turns_a);
    if (b == other.b) sum += linear_b.dot(other.moves_b) + angular_b.dot(other.turns_b);
    return sum;
  }
  double velocity(const SolverBodies& bodies) const {
    const SolverBody& A = bodies[a];
    const SolverBody& B = bodies[b];
    return linear_a.dot(A.v) + angular_a.dot(A.w) + linear_b.dot(B.v) + angular_b.dot(B.w);
  }
  double push_velocity(const SolverBodies& bodies) const {
    const SolverBody& A = bodies[a];
    const SolverBody& B = bodies[b];
    return linear_a.dot(A.push_v) + angular_a.dot(A.push_w) + linear_b.dot(B.push_v) +
           angular_b.dot(B.push_w);
  }
  // Adds to the impulse, and applies it.
  void give(SolverBodies& bodies, double more) {
    SolverBody& A = bodies[a];
    SolverBody& B = bodies[b];
    impulse += more;
    A.v += moves_a * more;
    A.w += turns_a * more;
    B.v += moves_b * more;
    B.w += turns_b * more;
  }
  void give_push(SolverBodies& bodies, double more) {
    SolverBody& A = bodies[a];
    SolverBody& B = bodies[b];
    push += more;
    A.push_v += moves_a * more;
    A.push_w += turns_a * more;
    B.push_v += moves_b * more;
    B.push_w += turns_b * more;
  }
  // One step of Gauss-Seidel; returns the change in velocity, m/s or rad/s.
  double relax(SolverBodies& bodies) {
    const double wanted = impulse + (target - velocity(bodies) - softness * impulse) * inverse;
    const double more = std::clamp(wanted, lower, upper) - impulse;
    if (more == 0.0) return 0.0;
    give(bodies, more);
    return std::abs(more) * response;
  }
};

}  // namespace ruedo::physics
