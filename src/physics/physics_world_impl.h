// Inside of PhysicsWorld: bodies, joints, broadphase and Bullet's solver, and which bodies need a
// step of Bullet.
//
// Included by physics_world.cpp and physics_world_impl.cpp only.
#pragma once

#include <memory>
#include <vector>

#include "physics/broadphase.h"
#include "physics/contact_book.h"
#include "physics/detection.h"
#include "physics/dynamics.h"
#include "physics/joints.h"
#include "physics/physics_world.h"
#include "physics/rigid_bodies.h"
#include "physics/surfaces.h"

namespace ruedo::physics {

// Which pairs of objects may touch at all: as SDF has it, and as set_support() says.
class MayTouch final : public PairFilter {
 public:
  bool may_touch(const btCollisionObject& object_a,
                 const btCollisionObject& object_b) const override;
};

// How a body goes through the coming step.
struct BodyMotion {
  enum class Kind : uint8_t { free, driven, guided };
  Kind kind = Kind::free;
  bool dirty = false;      // our pose and twist are newer than Bullet's
  bool tied = false;       // by a joint: always simulated while awake
  bool hung = false;       // by a joint to what never moves
  bool simulated = false;  // in this step
  bool fine = false;       // ... in the shorter substeps
  bool awake = false;      // when the step began
  bool led = false;        // of a mechanism's first body: motors hold it to its way
  int still = 0;           // steps for which it hardly moved, where it is tied
  bool fresh = true;       // put there since the last step: no step says how it accelerates
  Twist mean;
  Pose end;
};

// What may hold two bodies together for a while; no other: the body and the world.
struct Tie {
  BodyIndex body, other;
  std::unique_ptr<btFixedConstraint> constraint;
  bool closed = false;
  bool hung_before = false;  // the body, by something else
};

using WheelJointIndex = Index<struct WheelJointKind>;  // into Impl::wheels_

class PhysicsWorld::Impl {
 public:
  Impl(const model::WorldModel& world, const model::BodyLayout& layout);
  ~Impl();

  void step();
  void read(Snapshot& snapshot);
  void take(const Impl& other);

  void set_pose(BodyIndex body, const Pose& pose) {
    poses_[body] = pose;
    motions_[body].dirty = true;
    update_box(body);
  }
  void set_twist(BodyIndex body, const Twist& twist) {
    twists_[body] = twist;
    motions_[body].dirty = true;
  }
  void set_support(BodyIndex body, Support support);
  void apply_impulse(BodyIndex body, const Vec3& linear, const Vec3& angular);
  void add(InstanceIndex instance);
  void remove(InstanceIndex instance);
  void disturb(BodyIndex body);
  btRigidBody& bullet(BodyIndex body) { return *rigid_.bodies[body].bullet; }
  bool alone(BodyIndex body) const {
    return broadphase_.alone(rigid_.bodies[body].bullet->getBroadphaseHandle());
  }
  bool sleeping(BodyIndex body) const {
    return rigid_.bodies[body].bullet->getActivationState() == ISLAND_SLEEPING;
  }
  void sleep(BodyIndex body);

  void set_wind(const Vec3& wind);

  TieIndex make_tie(BodyIndex body, BodyIndex other);
  void close_tie(TieIndex tie);
  void open_tie(TieIndex tie);
  bool is_closed(TieIndex tie) const { return ties_[tie].closed; }

  RigidBodies rigid_;
  IndexedVector<BodyIndex, Pose> poses_;
  IndexedVector<BodyIndex, Twist> twists_, last_twists_;
  IndexedVector<BodyIndex, BodyMotion> motions_;
  ContactBook contacts_;
  IndexedVector<JointIndex, JointConstraint> joints_;  // as in the layout
  IndexedVector<JointIndex, JointIndex> leaders_;      // the one that it mimics, if it does
  // Of wheels that are bodies of their own; the others have none.
  IndexedVector<WheelJointIndex, JointConstraint> wheels_;
  IndexedVector<WheelIndex, WheelJointIndex> wheel_joint_;
  IndexedVector<WheelIndex, double> wheel_sign_;  // axis of the joint against that of the wheel

 private:
  void add_joints();  // those that are new
  void blow(int pace);
  void before_substep(int pace, double substep_s);
  void after_substep(int pace, double substep_s);
  void add_wheel(WheelIndex wheel);
  JointConstraint make_joint(InstanceIndex instance, ModelJointIndex joint);
  void add_joints(InstanceIndex instance);  // in the simulation, too
  void add_static(StaticObject& object);
  void reset_body(BodyIndex body);
  void refilter_all();
  int substeps_for(int64_t longest_us) const;
  void choose_pace();
  void find_led();
  void find_hurried();
  bool at_pace(JointIndex joint, int pace) const;
  BodyIndex body_of(JointIndex joint) const;  // that moves
  void step_at(int pace);
  void advance(btRigidBody& mover, double substep_s);
  void take_ties(const Impl& other);
  void take_body(BodyIndex body, const Impl& other);
  void tie(BodyIndex body, BodyIndex other);
  void untie(BodyIndex body, BodyIndex other);
  void push_to_bullet(BodyIndex body);  // our pose and twist
  void pull_from_bullet(BodyIndex body);
  void start(BodyIndex body);  // the velocity it begins the step with
  void update_box(BodyIndex body);
  void choose_simulated();
  std::vector<BodyIndex> mechanism_in_the_air(BodyIndex body) const;
  Vec3 velocity_now(BodyIndex body) const;
  void fall_at_start(const std::vector<BodyIndex>& bodies, Snapshot& snapshot) const;
  void accelerate_at_start(Snapshot& snapshot);
  void accelerate_at_start(const std::vector<BodyIndex>& bodies, Snapshot& snapshot);
  BodyIndex root(BodyIndex body);
  void bound_speeds(const std::vector<btRigidBody*>&
                        bodies);  // after a substep; throws StateError for what is not finite

  const model::WorldModel& world_;
  const model::BodyLayout& layout_;
  int64_t step_us_;
  int substeps_[2] = {1, 1};  // of each pace
  MayTouch filter_;
  btRigidBody ground_;  // what joints to the world hold on to
  Detection detection_;
  btCollisionDispatcher& dispatcher_;
  Broadphase broadphase_;
  Surfaces surfaces_;
  Dynamics dynamics_;
  Vec3 wind_ = Vec3::Zero();
  std::vector<btRigidBody*> simulated_[2];             // of each pace
  IndexedVector<BodyIndex, BodyIndex> parents_;        // union-find over bodies
  std::vector<BodyIndex> rolling_;                     // that are driven wheels
  std::vector<std::pair<BodyIndex, BodyIndex>> tied_;  // that a joint ties together
  IndexedVector<TieIndex, Tie> ties_;
  std::vector<std::pair<btRigidBody*, btTransform>> movers_;  // and where they began the step
};

}  // namespace ruedo::physics
