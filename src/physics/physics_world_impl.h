// Inside PhysicsWorld: bodies, joints, broadphase and solver, and which bodies need a Bullet step.
//
// Included by physics_world.cpp and physics_world_impl.cpp only.
#pragma once

#include <memory>
#include <vector>

#include "physics/bodies/contact_book.h"
#include "physics/bodies/joints.h"
#include "physics/bodies/rigid_bodies.h"
#include "physics/bodies/surfaces.h"
#include "physics/changes.h"
#include "physics/collision/broadphase.h"
#include "physics/collision/detection.h"
#include "physics/dynamics/dynamics.h"
#include "physics/physics_world.h"

namespace ruedo::physics {

// Which pairs of objects may touch at all: by SDF's rules and set_support().
class MayTouch final : public PairFilter {
 public:
  bool may_touch(const btCollisionObject& object_a,
                 const btCollisionObject& object_b) const override;
};

// How a body moves in the coming step.
struct BodyMotion {
  enum class Kind : uint8_t { free, driven, guided };
  Kind kind = Kind::free;
  bool dirty = false;      // our pose and twist are newer than Bullet's
  bool tied = false;       // has a joint: always simulated while awake
  bool hung = false;       // has a joint to something immovable
  bool simulated = false;  // in this step
  bool fine = false;       // ... with the shorter substeps
  bool awake = false;      // when the step began
  bool led = false;        // for a mechanism's first body: motors prescribe its motion
  int still = 0;           // number of steps with hardly any motion, for bodies with joints
  bool fresh = true;       // placed since the last step, so that its acceleration is not known
  bool listed = false;     // in Impl::busy_; not archived: listing more changes nothing
  Twist mean;
  Pose end;
  void exchange(StateArchive& archive) {
    archive(kind, dirty, tied, hung, simulated, fine, awake, led, still, fresh, mean, end);
  }
};

// A temporary connection of two bodies; without a second one, of the body and the world.
struct Tie {
  BodyIndex body, other;
  std::unique_ptr<btFixedConstraint> constraint;
  bool closed = false;
  bool hung_before = false;  // the body, by something else
};

using WheelJointIndex = Index<struct WheelJointKind>;  // into Impl::wheels_

class PhysicsWorld::Impl {
 public:
  Impl(const world::WorldModel& world, const world::BodyLayout& layout);
  ~Impl();

  void step();
  void read(Snapshot& snapshot);
  void copy_from(const Impl& other);
  void exchange(StateArchive& archive);

  void set_pose(BodyIndex body, const Pose& pose) {
    stir(body);
    poses_[body] = pose;
    motions_[body].dirty = true;
    update_box(body);
  }
  void set_twist(BodyIndex body, const Twist& twist) {
    stir(body);
    twists_[body] = twist;
    motions_[body].dirty = true;
  }
  // The next step considers the body. To be called by everything that moves or wakes it: a step
  // looks at no other bodies, so that those at rest cost nothing.
  void stir(BodyIndex body);
  void wake(BodyIndex body) {
    bullet(body).activate(true);
    stir(body);
  }
  JointConstraint& stirred(JointIndex joint);  // for a command: likewise for its bodies
  JointConstraint& stirred(WheelIndex wheel);
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
  IndexedVector<JointIndex, JointConstraint> joints_;  // numbered as in the layout
  IndexedVector<JointIndex, JointIndex> leaders_;      // the joint that it mimics, if any
  // For wheels that are separate bodies.
  IndexedVector<WheelJointIndex, JointConstraint> wheels_;
  IndexedVector<WheelIndex, WheelJointIndex> wheel_joint_;
  // sign of the joint's axis relative to the wheel's
  IndexedVector<WheelIndex, double> wheel_sign_;

 private:
  void add_joints();  // new ones
  void blow(int pace);
  void before_substep(int pace, double substep_s);
  void after_substep(int pace, double substep_s);
  void add_wheel(WheelIndex wheel);
  JointConstraint make_joint(InstanceIndex instance, ModelJointIndex joint);
  void add_joints(InstanceIndex instance);  // also in the running simulation
  void add_static(StaticObject& object);
  void reset_body(BodyIndex body);
  void refilter_all();
  [[noreturn]] void refuse_crowded(BodyIndex body, int64_t most, const char* how) const;
  void count_near_shapes();  // throws InputError for too many
  int substeps_for(int64_t longest_us) const;
  void choose_pace();
  void find_led();
  void find_hurried();
  void find_fast();
  BodyIndex body_of(JointIndex joint) const;  // the body that moves
  void step_at(int pace);
  void advance(btRigidBody& mover, double substep_s);
  void take_ties(const Impl& other);
  void take_body(BodyIndex body, const Impl& other);
  void exchange_ties(StateArchive& archive);
  void exchange_body(StateArchive& archive, BodyIndex body);
  std::vector<btTypedConstraint*> numbered_constraints();
  void tie(BodyIndex body, BodyIndex other);
  void untie(BodyIndex body, BodyIndex other);
  void push_to_bullet(BodyIndex body);  // transfers our pose and twist
  void pull_from_bullet(BodyIndex body);
  void start(BodyIndex body);  // sets its velocity at the start of the step
  void update_box(BodyIndex body);
  void list_joints();
  void stir_all();
  void renew();
  bool stirs(BodyIndex body) const;
  void find_busy();
  void choose_simulated();
  void choose_joints();
  void begin_contacts();
  std::vector<BodyIndex> mechanism_in_the_air(BodyIndex body) const;
  Vec3 velocity_now(BodyIndex body) const;
  void fall_at_start(const std::vector<BodyIndex>& bodies, Snapshot& snapshot) const;
  void read_body(BodyIndex body, Snapshot& snapshot) const;
  void read_joint(JointIndex joint, Snapshot& snapshot) const;
  void turn_accelerations(Snapshot& snapshot) const;
  void accelerate_at_start(Snapshot& snapshot);
  void accelerate_at_start(const std::vector<BodyIndex>& bodies, Snapshot& snapshot);
  BodyIndex root(BodyIndex body);
  void bound_speeds(const std::vector<btRigidBody*>&
                        bodies);  // after a substep; throws StateError if anything is not finite

  const world::WorldModel& world_;
  const world::BodyLayout& layout_;
  int64_t step_us_;
  int substeps_[2] = {1, 1};  // for each substep length
  MayTouch filter_;
  btRigidBody ground_;  // the other end of joints to the world
  Detection detection_;
  btCollisionDispatcher& dispatcher_;
  Broadphase broadphase_;
  Surfaces surfaces_;
  Dynamics dynamics_;
  Vec3 wind_ = Vec3::Zero();
  std::vector<btRigidBody*> simulated_[2];  // for each substep length
  // Bodies that may move in this step, and all that they could reach, in order; between two steps
  // those that the next one considers, in any order. Sleeping islands are not among them.
  std::vector<BodyIndex> busy_;
  std::vector<BodyIndex> considered_, spreading_;  // scratch
  Changes changes_;
  bool any_fresh_ = true;                                        // a body may be
  IndexedVector<BodyIndex, std::vector<JointIndex>> joints_of_;  // those that move it
  IndexedVector<BodyIndex, std::vector<WheelJointIndex>> wheels_of_;
  std::vector<JointIndex> busy_joints_[2];  // for each substep length, in order
  std::vector<WheelJointIndex> busy_wheels_;
  IndexedVector<BodyIndex, BodyIndex> parents_;        // union-find over bodies
  std::vector<std::pair<BodyIndex, BodyIndex>> tied_;  // pairs connected by a joint
  IndexedVector<TieIndex, Tie> ties_;
  // with their poses at the start of the step
  std::vector<std::pair<btRigidBody*, btTransform>> movers_;
};

}  // namespace ruedo::physics
