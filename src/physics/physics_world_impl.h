// Inside of PhysicsWorld: bodies, joints, broadphase and Bullet's solver, and which bodies need a
// step of Bullet.
//
// Included by physics_world.cpp and physics_world_impl.cpp only.
#pragma once

#include <vector>

#include "physics/broadphase.h"
#include "physics/contact_book.h"
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
  bool fresh = true;  // put there since the last step: nothing says how it accelerates but gravity
  Twist mean;
  Pose end;
};

class PhysicsWorld::Impl {
 public:
  Impl(const model::WorldModel& world, const model::BodyLayout& layout);
  ~Impl();

  void step();
  void read(Snapshot& snapshot) const;

  void set_pose(int body, const Pose& pose) {
    poses_[index(body)] = pose;
    motions_[index(body)].dirty = true;
    update_box(body);
  }
  void set_twist(int body, const Twist& twist) {
    twists_[index(body)] = twist;
    motions_[index(body)].dirty = true;
  }
  void set_support(int body, Support support);
  void apply_impulse(int body, const Vec3& linear, const Vec3& angular);
  void add(int instance);
  void remove(int instance);
  void disturb(int body);
  btRigidBody& bullet(int body) { return *rigid_.bodies[index(body)].bullet; }
  bool alone(int body) const {
    return broadphase_.alone(rigid_.bodies[index(body)].bullet->getBroadphaseHandle());
  }
  bool falling(int body) const;
  bool sleeping(int body) const {
    return rigid_.bodies[index(body)].bullet->getActivationState() == ISLAND_SLEEPING;
  }
  void sleep(int body);

  void set_wind(const Vec3& wind);

  static size_t index(int body) { return static_cast<size_t>(body); }

  RigidBodies rigid_;
  std::vector<Pose> poses_;
  std::vector<Twist> twists_, last_twists_;
  std::vector<BodyMotion> motions_;
  ContactBook contacts_;
  std::vector<JointConstraint> joints_;  // as in the layout
  std::vector<int> leaders_;  // of each joint, into joints_: the one that it mimics; -1: none
  std::vector<JointConstraint> wheels_;  // those that are bodies of their own
  std::vector<int> wheel_joint_;         // of each wheel, into wheels_; -1: none
  std::vector<double> wheel_sign_;       // axis of the joint against that of the wheel

 private:
  void add_joints();  // those that are new
  void blow(int pace);
  void before_substep(int pace, double substep_s);
  void after_substep(int pace, double substep_s);
  void add_wheel(size_t wheel);
  JointConstraint make_joint(int instance, int joint);
  void add_joints(int instance);  // in the simulation, too
  void add_static(StaticObject& object);
  void reset_body(int body);
  void refilter_all();
  int substeps_for(int64_t longest_us) const;
  void choose_pace();
  void find_led();
  void find_hurried();
  bool at_pace(size_t joint, int pace) const;
  int body_of(size_t joint) const;  // that moves
  void step_at(int pace);
  void advance(btRigidBody& mover, double substep_s);
  void tie(int body, int other);
  void push_to_bullet(int body);  // our pose and twist
  void pull_from_bullet(int body);
  void start(int body);  // the velocity it begins the step with
  void update_box(int body);
  void choose_simulated();
  size_t root(size_t body);
  void bound_speeds(const std::vector<btRigidBody*>&
                        bodies);  // after a substep; throws StateError for what is not finite

  const model::WorldModel& world_;
  const model::BodyLayout& layout_;
  int64_t step_us_;
  int substeps_[2] = {1, 1};  // of each pace
  MayTouch filter_;
  btRigidBody ground_;  // what joints to the world hold on to
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  Broadphase broadphase_;
  Surfaces surfaces_;
  Dynamics dynamics_;
  Vec3 wind_ = Vec3::Zero();
  std::vector<btRigidBody*> simulated_[2];                    // of each pace
  std::vector<size_t> parents_;                               // union-find over bodies
  std::vector<int> rolling_;                                  // bodies that are driven wheels
  std::vector<std::pair<int, int>> tied_;                     // bodies that a joint ties together
  std::vector<std::pair<btRigidBody*, btTransform>> movers_;  // and where they began the step
};

}  // namespace ruedo::physics
