// The state of the world at one step: written once by the kinematics module, then read by all
// others.
//
// Index spaces are those of world::BodyLayout. Everything is in the world frame and in SI units
// unless a comment says otherwise. Plain arrays: copying one allocates nothing once its vectors
// have their size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

#include "ruedo/index.h"
#include "ruedo/pose.h"
#include "ruedo/sim_time.h"

namespace ruedo {

// Two shapes that touched during the step that led to this state.
struct Contact {
  LinkIndex link_a, link_b;
  BodyIndex body_a, body_b;      // none: static
  Vec3 position = Vec3::Zero();  // m, world
  Vec3 normal = Vec3::UnitZ();   // unit, world, from b towards a
  double force = 0.0;            // N along the normal, mean over the step
  Vec3 friction = Vec3::Zero();  // N on a, world, mean over the step
  double depth = 0.0;            // m, positive inside
  ShapeIndex shape_a, shape_b;   // among the links' collisions; none: not known
};

// The contacts of a state, in a fixed order: first those of bodies that move, then those between
// bodies at rest, which consecutive states share.
class ContactList {
 public:
  using Shared = std::shared_ptr<const std::vector<Contact>>;
  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = Contact;
    using difference_type = std::ptrdiff_t;
    using pointer = const Contact*;
    using reference = const Contact&;
    Iterator() = default;
    Iterator(const ContactList& list, size_t at) : list_(&list), at_(at) {}
    reference operator*() const { return (*list_)[at_]; }
    pointer operator->() const { return &(*list_)[at_]; }
    Iterator& operator++() { return ++at_, *this; }
    Iterator operator++(int) { return {*list_, at_++}; }
    bool operator==(const Iterator& other) const { return at_ == other.at_; }

   private:
    const ContactList* list_ = nullptr;
    size_t at_ = 0;
  };

  ContactList() = default;
  ContactList(std::vector<Contact> moving)  // NOLINT(google-explicit-constructor)
      : moving_(std::move(moving)) {}
  ContactList(std::initializer_list<Contact> moving) : moving_(moving) {}

  size_t size() const { return moving_.size() + (resting_ ? resting_->size() : 0); }
  bool empty() const { return size() == 0; }
  const Contact& operator[](size_t i) const {
    return i < moving_.size() ? moving_[i] : (*resting_)[i - moving_.size()];
  }
  const Contact& operator[](ContactIndex i) const {
    return (*this)[static_cast<size_t>(static_cast<int>(i))];
  }
  Iterator begin() const { return {*this, 0}; }
  Iterator end() const { return {*this, size()}; }

  std::vector<Contact>& moving() { return moving_; }
  const std::vector<Contact>& moving() const { return moving_; }
  const Shared& resting() const { return resting_; }  // null: none
  void set_resting(Shared resting) { resting_ = std::move(resting); }
  template <class Archive>
  void exchange(Archive& archive) {
    std::vector<Contact> resting = resting_ ? *resting_ : std::vector<Contact>();
    archive(moving_, resting);
    if (archive.reads())
      resting_ = std::make_shared<const std::vector<Contact>>(std::move(resting));
  }

 private:
  std::vector<Contact> moving_;
  Shared resting_;
};

// A contact of a robot with an obstacle: not a part of it, nor the ground that carries it, nor a
// load on it.
struct Collision {
  RobotIndex robot;
  ContactIndex contact;
  bool as_a = true;  // the robot's is link_a
};

// The motion that a robot's drive executes; as motion_status_t, but for the last two members.
struct MotionState {
  int64_t id = 0;
  int8_t kind = 0, state = 0, reason = 0;
  double done = 0.0, remaining = 0.0;
  LinkIndex blocked_by = {};  // while the reason is that it is blocked
  int64_t changes = 0;  // counts the changes of id, kind, state and reason, and the MotionEnds
};

// The motion that a command ended in this step: a primitive that it replaced, or the command
// itself, refused.
struct MotionEnd {
  RobotIndex robot;
  MotionState state;
};

struct RobotState {
  Pose X_WBase;  // base_link
  Twist twist;   // of base_link, expressed in base_link
  Vec3 acceleration =
      Vec3::Zero();  // m/s^2 of base_link's origin, expressed in base_link, without gravity
  double wheel_v = 0.0, wheel_omega = 0.0;  // m/s, rad/s: what the wheels do, before slip
  MotionState motion;
  int32_t odometry_resets = 0;  // counts the commands that reset the odometry
};

struct Snapshot {
  int64_t step = 0;
  SimTime time = 0;
  Vec3 wind = Vec3::Zero();                           // m/s: in the step that led here
  IndexedVector<BodyIndex, Pose> bodies;              // X_WB
  IndexedVector<BodyIndex, Twist> body_twists;        // of B's origin
  IndexedVector<BodyIndex, Vec3> body_accelerations;  // m/s^2, of B's origin, without gravity
  IndexedVector<WheelIndex, double>
      wheel_angles;  // rad since the start, positive ahead, not wrapped
  IndexedVector<WheelIndex, double> wheel_rates;      // rad/s
  IndexedVector<JointIndex, double> joint_positions;  // rad or m
  IndexedVector<JointIndex, double> joint_velocities;
  IndexedVector<JointIndex, double> joint_efforts;
  IndexedVector<RobotIndex, RobotState> robots;
  std::vector<MotionEnd> motion_ends;  // by robot, then in the order of the commands
  ContactList contacts;
  std::vector<Collision> collisions;  // by robot, then in the order of the contacts
  // Bodies that may differ from those of the state before, in order.
  std::vector<BodyIndex> moving;
  // Of which world these are the bodies and joints, and its state: what read them knows what has
  // changed since, and need not read the rest again.
  struct Source {
    uint64_t world = 0, state = 0;
  } source;
};

}  // namespace ruedo
