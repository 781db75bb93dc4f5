// A step of the physics world.
//
// For repeatable runs: pairs and contacts in numerical order, objects added in world order, and a
// broadphase that does not depend on addresses. A world that is created again gives the same bits.
#include "physics/physics_world_impl.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "base/math/sincos.h"
#include "physics/state_check.h"
#include "ruedo/errors.h"
#include "ruedo/quantity.h"

namespace ruedo::physics {

namespace {

// Jointed bodies need shorter substeps, and so do the bodies that touch them. No others do: an
// unrelated robot must not change one bit of a stack.
constexpr int64_t kLongestSubstep_us = 5000, kLongestSubstepOfJoints_us = 1000;
enum Pace { kCoarse, kFine };
// Distance at which Bullet starts to see a contact: a body may come this near in one substep
// without touching.
constexpr double kContactReach_m = 0.02;

// Limit of nearby pairs at the start, of bodies and of their shapes: their number grows with the
// square of those in one place.
constexpr int kMostPairs = 200'000;
// The same for those that may not touch, as links of one model, and only cost a look.
constexpr int64_t kMostNear = 10'000'000;

// How many shapes of `b` are near that box.
int shapes_near(const btCollisionObject& b, const btVector3& low_W, const btVector3& high_W) {
  const btCollisionShape* shape = b.getCollisionShape();
  btVector3 low, high;
  if (!shape->isCompound()) {
    shape->getAabb(b.getWorldTransform(), low, high);
    return TestAabbAgainstAabb2(low, high, low_W, high_W) ? 1 : 0;
  }
  struct Count : btDbvt::ICollide {
    void Process(const btDbvtNode*) override { ++found; }
    int found = 0;
  } count;
  const btDbvt& tree = *static_cast<const btCompoundShape&>(*shape).getDynamicAabbTree();
  btTransformAabb(low_W, high_W, 0.0, b.getWorldTransform().inverse(), low, high);
  tree.collideTV(tree.m_root, btDbvtVolume::FromMM(low, high), count);
  return count.found;
}

// How many shapes of the two are near each other; once it is above kMostPairs, at least that.
int near_shapes(const btCollisionObject& a, const btCollisionObject& b) {
  if (!a.getCollisionShape()->isCompound()) {
    if (b.getCollisionShape()->isCompound()) return near_shapes(b, a);
    return 1;
  }
  const auto& shapes = static_cast<const btCompoundShape&>(*a.getCollisionShape());
  int near = 0;
  for (int i = 0; i < shapes.getNumChildShapes() && near <= kMostPairs; ++i) {
    btVector3 low, high;
    shapes.getChildShape(i)->getAabb(a.getWorldTransform() * shapes.getChildTransform(i), low,
                                     high);
    near += shapes_near(b, low, high);
  }
  return near;
}

// How far from a body of that size its contacts are sought. Of small things in a heap, all would be
// within the reach of large ones.
double contact_reach_m(const RigidBody& rigid, const Vec3& angular, double step_s) {
  constexpr double kLeast_m = 3e-3, kOfSize = 0.25;
  const double size_m = 2.0 * rigid.box_half.maxCoeff();
  const double turns_m =
      angular.norm() * (rigid.box_center.norm() + rigid.box_half.norm()) * step_s;
  return std::min(kLeast_m + kOfSize * size_m + turns_m, kContactReach_m);
}

// rad/s at which the body's shape turns: not a ball's, and not a cylinder's about its axis.
double turning_of(const RigidBody& rigid, const Vec3& angular) {
  if (rigid.compound->getNumChildShapes() != 1) return angular.norm();
  const btTransform& X_IC = rigid.compound->getChildTransform(0);
  const btVector3 off = X_IC.getOrigin(), axis = X_IC.getBasis().getColumn(2);
  switch (rigid.compound->getChildShape(0)->getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE: return off.fuzzyZero() ? 0.0 : angular.norm();
    case CYLINDER_SHAPE_PROXYTYPE:
      if (!off.cross(axis).fuzzyZero()) return angular.norm();
      return angular.cross(from_bt(rigid.bullet->getWorldTransform().getBasis() * axis)).norm();
    default: return angular.norm();
  }
}

}  // namespace

bool MayTouch::may_touch(const btCollisionObject& object_a,
                         const btCollisionObject& object_b) const {
  const ObjectInfo& a = info_of(object_a);
  const ObjectInfo& b = info_of(object_b);
  if (a.shapes.empty() || b.shapes.empty()) return false;  // no shapes
  if (a.gone || b.gone) return false;
  if ((a.moved || !a.body.valid()) && (b.moved || !b.body.valid())) return false;
  if ((a.on_plane && b.plane) || (b.on_plane && a.plane)) return false;
  // As in SDF: links of one model collide if it has self_collide, but never across a joint.
  if (std::find(a.joined.begin(), a.joined.end(), b.body) != a.joined.end()) return false;
  return a.instance != b.instance || a.self_collide;
}

PhysicsWorld::Impl::Impl(const world::WorldModel& world, const world::BodyLayout& layout)
    : rigid_(world, layout),
      contacts_(layout.bodies.size()),
      world_(world),
      layout_(layout),
      step_us_(world.step_us),
      ground_(btRigidBody::btRigidBodyConstructionInfo(0.0, nullptr, nullptr)),
      detection_(layout.bodies.size()),
      dispatcher_(detection_.dispatcher()),
      broadphase_(filter_),
      dynamics_(dispatcher_, broadphase_, detection_.configuration(), surfaces_,
                SolverSettings{world.solver.iterations, world.solver.tolerance,
                               world.solver.error_reduction}) {
  gContactBreakingThreshold = kContactReach_m;  // a global of Bullet: the same in every world
  gDisableDeactivation = false;
  dynamics_.setForceUpdateAllAabbs(false);
  substeps_[kCoarse] = substeps_for(kLongestSubstep_us);
  substeps_[kFine] = substeps_for(kLongestSubstepOfJoints_us);

  for (const auto& object : rigid_.statics) add_static(*object);
  const size_t n = layout.bodies.size();
  motions_.resize(n);
  for (auto& bodies : simulated_) bodies.reserve(n);
  dynamics_.reserve(n);
  twists_.resize(n);
  for (const auto& body : layout.bodies) poses_.push_back(body.X_WB.normalized());
  add_joints();
  for (const BodyIndex i : rigid_.bodies.indices()) {
    dynamics_.addRigidBody(rigid_.bodies[i].bullet.get(), btBroadphaseProxy::DefaultFilter,
                           btBroadphaseProxy::AllFilter);
    update_box(i);
    if (broadphase_.getOverlappingPairCache()->getNumOverlappingPairs() > kMostPairs)
      refuse_crowded(i, kMostPairs, "touch");
    if (broadphase_.looked_at() > kMostNear) refuse_crowded(i, kMostNear, "are near");
  }
  count_near_shapes();
  for (JointConstraint& joint : joints_)
    if (joint.constraint()) dynamics_.addConstraint(joint.constraint(), true);
  for (JointConstraint& joint : wheels_)
    if (joint.constraint()) dynamics_.addConstraint(joint.constraint(), true);
  last_twists_ = twists_;
  list_joints();
  for (auto* list : {&busy_, &considered_, &spreading_}) list->reserve(2 * n);
  renew();
}

void PhysicsWorld::Impl::refuse_crowded(BodyIndex body, int64_t most, const char* how) const {
  throw InputError({world_.file, 0}, "more than " + std::to_string(most) + " pairs of things " +
                                         how + " each other at the start: '" +
                                         layout_.bodies[body].name +
                                         "' stands among too many; move them apart");
}

void PhysicsWorld::Impl::count_near_shapes() {
  const btBroadphasePairArray& pairs =
      broadphase_.getOverlappingPairCache()->getOverlappingPairArray();
  int64_t near = 0;
  for (int i = 0; i < pairs.size(); ++i) {
    const auto& a = *static_cast<const btCollisionObject*>(pairs[i].m_pProxy0->m_clientObject);
    const auto& b = *static_cast<const btCollisionObject*>(pairs[i].m_pProxy1->m_clientObject);
    near += near_shapes(a, b);
    if (near > kMostPairs)
      refuse_crowded(info_of(info_of(a).body.valid() ? a : b).body, kMostPairs, "touch");
  }
}

int PhysicsWorld::Impl::substeps_for(int64_t longest_us) const {
  if (world_.solver.substeps > 0) return world_.solver.substeps;
  return static_cast<int>((step_us_ + longest_us - 1) / longest_us);
}

PhysicsWorld::Impl::~Impl() {
  for (const std::span<JointConstraint> joints : {std::span(joints_), std::span(wheels_)}) {
    for (JointConstraint& joint : joints) {
      if (joint.constraint() && joint.constraint()->isEnabled())
        dynamics_.removeConstraint(joint.constraint());
    }
  }
  for (Tie& each : ties_) dynamics_.removeConstraint(each.constraint.get());
  dynamics_.set_bodies({});
  for (size_t i = rigid_.bodies.size(); i-- > 0;) {
    broadphase_.destroyProxy(rigid_.bodies[i].bullet->getBroadphaseHandle(), &dispatcher_);
  }
  for (size_t i = rigid_.statics.size(); i-- > 0;) {
    btBroadphaseProxy* proxy = rigid_.statics[i]->bullet.getBroadphaseHandle();
    if (proxy) broadphase_.destroyProxy(proxy, &dispatcher_);
  }
}

JointConstraint PhysicsWorld::Impl::make_joint(InstanceIndex instance,
                                               ModelJointIndex joint_index) {
  const auto& placed = world_.models[instance];
  const world::Joint& joint = placed.model->joints[joint_index];
  const auto body_of = [&](ModelLinkIndex link) {
    return link.valid() ? layout_.links[layout_.link_of(instance, link)].body : BodyIndex();
  };
  const BodyIndex parent = body_of(joint.parent), child = body_of(joint.child);
  const Pose X_WJ = placed.X_WM * joint.X_MJ;
  const auto in_body = [&](BodyIndex body) {
    return body.valid() ? rigid_.bodies[body].X_BI.inverse() * poses_[body].inverse() * X_WJ : X_WJ;
  };
  if (child.valid()) {
    tie(child, parent);
  } else {
    tie(parent, child);  // the joint's child is fixed to the world
  }
  const BodyIndex reference = body_of(joint.gear_reference);
  const bool gears = joint.type == world::JointType::gearbox;
  if (gears && reference.valid()) {
    for (const BodyIndex body : {parent, child})
      if (body.valid()) tie(body, reference);
  }
  return {joint,
          parent.valid() ? bullet(parent) : ground_,
          child.valid() ? bullet(child) : ground_,
          in_body(parent),
          in_body(child),
          !gears              ? nullptr
          : reference.valid() ? &bullet(reference)
                              : &ground_};
}

void PhysicsWorld::Impl::add_joints() {
  for (JointIndex i = joints_.next(); layout_.joints.has(i); ++i) {
    joints_.push_back(make_joint(layout_.joints[i].instance, layout_.joints[i].joint));
  }
  const auto leader_of = [&](const auto& placed) {
    const ModelJointIndex leader =
        world_.models[placed.instance].model->joints[placed.joint].leader;
    const auto same = [&](const auto& each) {
      return each.instance == placed.instance && each.joint == leader;
    };
    const auto found = std::find_if(layout_.joints.begin(), layout_.joints.end(), same);
    return !leader.valid() || found == layout_.joints.end()
               ? JointIndex()
               : JointIndex(found - layout_.joints.begin());
  };
  for (JointIndex i = leaders_.next(); layout_.joints.has(i); ++i)
    leaders_.push_back(leader_of(layout_.joints[i]));
  for (WheelIndex i = wheel_joint_.next(); layout_.wheels.has(i); ++i) add_wheel(i);
}

void PhysicsWorld::Impl::add_wheel(WheelIndex i) {
  const auto& wheel = layout_.wheels[i];
  const auto& robot = layout_.robots[wheel.robot];
  const auto& link = layout_.links[wheel.link];
  wheel_joint_.emplace_back();
  wheel_sign_.push_back(1.0);
  if (!link.body.valid() || link.body == robot.body) return;
  wheel_joint_[i] = wheels_.next();
  wheels_.push_back(make_joint(robot.instance, wheel.joint));
  const auto& model = *world_.models[robot.instance].model;
  const world::Joint& joint = model.joints[wheel.joint];
  const Vec3 axis_in_M = joint.X_MJ.rotation * joint.axis.axis_in_J;
  const Vec3 ahead_in_M = model.links[link.link].X_ML.rotation * wheel.axis_in_L;
  wheel_sign_[i] = axis_in_M.dot(ahead_in_M) < 0.0 ? -1.0 : 1.0;
}

void PhysicsWorld::Impl::list_joints() {
  joints_of_.assign(motions_.size(), {});
  wheels_of_.assign(motions_.size(), {});
  for (const JointIndex i : joints_.indices())
    if (const BodyIndex body = body_of(i); body.valid()) joints_of_[body].push_back(i);
  for (const WheelIndex i : wheel_joint_.indices()) {
    if (wheel_joint_[i].valid())
      wheels_of_[layout_.links[layout_.wheels[i].link].body].push_back(wheel_joint_[i]);
  }
}

void PhysicsWorld::Impl::tie(BodyIndex body, BodyIndex other) {
  motions_[body].tied = true;
  if (!other.valid()) {
    motions_[body].hung = true;
    return;
  }
  motions_[other].tied = true;
  tied_.emplace_back(body, other);
  rigid_.bodies[body].info.joined.push_back(other);
  rigid_.bodies[other].info.joined.push_back(body);
}

void PhysicsWorld::Impl::push_to_bullet(BodyIndex body) {
  RigidBody& rigid = rigid_.bodies[body];
  btRigidBody& bullet = *rigid.bullet;
  const Pose& X_WB = poses_[body];
  const btTransform X_WI = to_bt((X_WB * rigid.X_BI).normalized());
  bullet.setWorldTransform(X_WI);
  bullet.setInterpolationWorldTransform(X_WI);
  bullet.updateInertiaTensor();
  const Twist& twist = twists_[body];
  const Vec3 arm = X_WB.rotation * rigid.X_BI.translation;
  bullet.setLinearVelocity(to_bt(Vec3(twist.linear + twist.angular.cross(arm))));
  bullet.setAngularVelocity(to_bt(twist.angular));
  motions_[body].dirty = false;
}

void PhysicsWorld::Impl::pull_from_bullet(BodyIndex body) {
  const RigidBody& rigid = rigid_.bodies[body];
  const Pose X_WB =
      (from_bt(rigid.bullet->getWorldTransform()) * rigid.X_BI.inverse()).normalized();
  poses_[body] = X_WB;
  const Vec3 arm = X_WB.rotation * rigid.X_BI.translation;
  Twist& twist = twists_[body];
  twist.angular = from_bt(rigid.bullet->getAngularVelocity());
  twist.linear = from_bt(rigid.bullet->getLinearVelocity()) - twist.angular.cross(arm);
}

// The box that the body may occupy during the step, plus the reach of contacts.
void PhysicsWorld::Impl::update_box(BodyIndex body) {
  const RigidBody& rigid = rigid_.bodies[body];
  btBroadphaseProxy* proxy = rigid.bullet->getBroadphaseHandle();
  if (!proxy || rigid.info.shapes.empty()) return;
  const BodyMotion& motion = motions_[body];
  const double step_s = static_cast<double>(step_us_) * 1e-6;
  const double reach_m = contact_reach_m(rigid, twists_[body].angular, step_s);
  const auto half_of = [&rigid, reach_m](const Pose& X) {
    return Vec3(X.rotation.toRotationMatrix().cwiseAbs() * rigid.box_half +
                Vec3::Constant(reach_m));
  };
  const Pose& from = poses_[body];
  const Vec3 center = from * rigid.box_center, half = half_of(from);
  Vec3 low = center - half, high = center + half;
  if (motion.kind == BodyMotion::Kind::guided) {
    const Vec3 end_center = motion.end * rigid.box_center, end_half = half_of(motion.end);
    low = low.cwiseMin(end_center - end_half);
    high = high.cwiseMax(end_center + end_half);
  } else {
    const Twist& twist = motion.kind == BodyMotion::Kind::driven ? motion.mean : twists_[body];
    const Vec3 way = twist.linear * step_s;
    low += way.cwiseMin(0.0);
    high += way.cwiseMax(0.0);
  }
  broadphase_.setAabb(proxy, to_bt(low), to_bt(high), &dispatcher_);
}

void PhysicsWorld::Impl::start(BodyIndex body) {
  BodyMotion& motion = motions_[body];
  bullet(body).setHitFraction(motion.kind == BodyMotion::Kind::free ? 1.0 : 0.0);
  if (motion.kind == BodyMotion::Kind::free) {
    if (motion.dirty) push_to_bullet(body);
    return;
  }
  const Twist now = twists_[body];
  twists_[body] = motion.mean;
  push_to_bullet(body);
  twists_[body] = now;
}

void PhysicsWorld::Impl::stir(BodyIndex body) {
  if (!std::exchange(motions_[body].listed, true)) busy_.push_back(body);
}

void PhysicsWorld::Impl::stir_all() {
  for (const BodyIndex i : motions_.indices()) stir(i);
}

// The state was replaced by another one.
void PhysicsWorld::Impl::renew() {
  stir_all();
  any_fresh_ = true;
  changes_.forget(motions_.size());
}

JointConstraint& PhysicsWorld::Impl::stirred(JointIndex joint) {
  const auto& placed = layout_.joints[joint];
  for (const BodyIndex body : {placed.child_body, placed.parent_body})
    if (body.valid()) stir(body);
  return joints_[joint];
}

JointConstraint& PhysicsWorld::Impl::stirred(WheelIndex wheel) {
  stir(layout_.links[layout_.wheels[wheel].link].body);
  return wheels_[wheel_joint_[wheel]];
}

// Whether it moves by itself, or something outside moves it.
bool PhysicsWorld::Impl::stirs(BodyIndex body) const {
  const BodyMotion& motion = motions_[body];
  const RigidBody& rigid = rigid_.bodies[body];
  if (rigid.info.gone) return false;
  const bool free = motion.kind == BodyMotion::Kind::free;
  if (!rigid.info.moved) return !free || !sleeping(body);
  const Twist& twist = free ? twists_[body] : motion.mean;
  return !twist.linear.isZero(0.0) || !twist.angular.isZero(0.0);
}

// The bodies that stir, and all that they could reach in this step, through contacts and joints.
void PhysicsWorld::Impl::find_busy() {
  considered_.clear();
  considered_.swap(busy_);
  spreading_.clear();
  for (const BodyIndex i : considered_) {
    motions_[i].listed = motions_[i].simulated = false;
    if (rigid_.bodies[i].info.gone) continue;
    if (motions_[i].kind != BodyMotion::Kind::free) {
      bullet(i).setDeactivationTime(0.0);
      bullet(i).setActivationState(ACTIVE_TAG);
      update_box(i);
    } else if (!sleeping(i) && !rigid_.bodies[i].info.moved) {
      update_box(i);
    }
  }
  const auto reach = [this](BodyIndex body) {
    if (!body.valid() || motions_[body].listed || rigid_.bodies[body].info.gone) return;
    stir(body);
    if (!rigid_.bodies[body].info.moved) spreading_.push_back(body);
  };
  for (const BodyIndex i : considered_) {
    if (rigid_.bodies[i].info.gone || (!stirs(i) && motions_[i].kind == BodyMotion::Kind::free))
      continue;
    reach(i);
    if (rigid_.bodies[i].info.moved && stirs(i)) spreading_.push_back(i);
  }
  for (size_t next = 0; next < spreading_.size(); ++next) {
    const BodyIndex body = spreading_[next];
    broadphase_.for_each_partner(
        bullet(body).getBroadphaseHandle(),
        [&](const btCollisionObject& partner) { reach(info_of(partner).body); });
    for (const BodyIndex other : rigid_.bodies[body].info.joined) reach(other);
  }
  std::sort(busy_.begin(), busy_.end());
}

void PhysicsWorld::Impl::choose_simulated() {
  find_busy();
  bool any = false;
  for (const BodyIndex i : busy_) {
    BodyMotion& motion = motions_[i];
    motion.simulated =
        motion.tied || !alone(i) ||
        (motion.kind != BodyMotion::Kind::guided && !sleeping(i) && !rigid_.bodies[i].info.moved);
    if (motion.simulated) start(i);
    any |= motion.simulated;
  }
  for (auto& bodies : simulated_) bodies.clear();
  if (any) choose_pace();
  choose_joints();
}

BodyIndex PhysicsWorld::Impl::root(BodyIndex body) {
  while (parents_[body] != body) body = parents_[body] = parents_[parents_[body]];
  return body;
}

// Bodies connected by joints, and everything that may touch them in this step, use the shorter
// substeps.
void PhysicsWorld::Impl::choose_pace() {
  parents_.resize(motions_.size());
  for (const BodyIndex i : busy_) parents_[i] = i;
  const auto movable = [&](BodyIndex body) {
    return body.valid() && motions_[body].simulated && !rigid_.bodies[body].info.moved;
  };
  const auto together = [&](BodyIndex a, BodyIndex b) {
    if (!movable(a) || !movable(b)) return;
    const BodyIndex of_a = root(a), of_b = root(b);
    parents_[std::max(of_a, of_b)] = std::min(of_a, of_b);
  };
  for (const BodyIndex i : busy_) {
    for (const BodyIndex other : rigid_.bodies[i].info.joined) together(i, other);
    broadphase_.for_each_partner(
        bullet(i).getBroadphaseHandle(),
        [&](const btCollisionObject& partner) { together(i, info_of(partner).body); });
    motions_[i].fine = motions_[i].led = false;
  }
  find_led();
  find_hurried();
  find_fast();
  for (const BodyIndex i : busy_) {
    if (!motions_[i].simulated) continue;
    if (rigid_.bodies[i].info.moved) continue;
    motions_[i].fine = motions_[root(i)].fine;
    motions_[i].awake = rigid_.bodies[i].bullet->isActive();
    simulated_[motions_[i].fine ? kFine : kCoarse].push_back(rigid_.bodies[i].bullet.get());
  }
}

// A mechanism fixed to the world whose motors prescribe every joint, and that touches nothing,
// moves as prescribed: shorter substeps would give the same path.
void PhysicsWorld::Impl::find_led() {
  for (const BodyIndex i : busy_) {
    if (motions_[i].simulated && motions_[i].hung) motions_[root(i)].led = true;
  }
  for (const BodyIndex i : busy_) {
    if (motions_[i].simulated && !alone(i)) motions_[root(i)].led = false;
  }
  const auto stray = [this](BodyIndex body) {
    if (body.valid() && motions_[body].simulated) motions_[root(body)].led = false;
  };
  for (const BodyIndex body : busy_) {
    for (const JointIndex i : joints_of_[body]) {
      if (!joints_[i].leads()) stray(body);
      if (leaders_[i].valid()) stray(body_of(leaders_[i]));  // a mimic joint moves with its leader
    }
  }
}

// A mechanism that has been still for a while, without a command to move, needs no short substeps:
// an arm that holds its load.
void PhysicsWorld::Impl::find_hurried() {
  constexpr double kStill_m_s = 1e-3, kStill_rad_s = 1e-3;
  constexpr int kStillSteps = 20;
  for (const BodyIndex i : busy_) {
    BodyMotion& motion = motions_[i];
    if (!motion.simulated || !motion.tied) continue;
    const bool still = twists_[i].linear.squaredNorm() < kStill_m_s * kStill_m_s &&
                       twists_[i].angular.squaredNorm() < kStill_rad_s * kStill_rad_s;
    motion.still = still ? std::min(motion.still + 1, kStillSteps) : 0;
    if (motion.still < kStillSteps && !motions_[root(i)].led) motions_[root(i)].fine = true;
  }
  for (const BodyIndex body : busy_) {
    if (!motions_[body].simulated) continue;
    BodyMotion& first = motions_[root(body)];
    for (const JointIndex i : joints_of_[body])
      if ((joints_[i].may_start() && !first.led) || leaders_[i].valid()) first.fine = true;
    if (!wheels_of_[body].empty()) first.fine = true;
  }
}

// Nor do long substeps fit what turns far or moves far for its size in one, and what is so small
// that its weight alone makes it.
void PhysicsWorld::Impl::find_fast() {
  constexpr double kFarthest = 0.5, kFarthest_rad = 0.2;  // of the half thickness
  const double substep_s = static_cast<double>(std::min(step_us_, kLongestSubstep_us)) * 1e-6;
  for (const BodyIndex i : busy_) {
    const RigidBody& rigid = rigid_.bodies[i];
    if (!motions_[i].simulated || motions_[i].kind != BodyMotion::Kind::free || rigid.info.moved ||
        sleeping(i) || rigid.info.shapes.empty())
      continue;
    const double way =
        twists_[i].linear.norm() + from_bt(rigid.bullet->getGravity()).norm() * substep_s;
    if (way * substep_s > kFarthest * rigid.box_half.minCoeff() ||
        turning_of(rigid, twists_[i].angular) * substep_s > kFarthest_rad)
      motions_[root(i)].fine = true;
  }
}

// The joints of simulated bodies.
void PhysicsWorld::Impl::choose_joints() {
  for (auto& joints : busy_joints_) joints.clear();
  busy_wheels_.clear();
  for (const BodyIndex body : busy_) {
    if (!motions_[body].simulated) continue;
    auto& joints = busy_joints_[motions_[body].fine ? kFine : kCoarse];
    joints.insert(joints.end(), joints_of_[body].begin(), joints_of_[body].end());
    busy_wheels_.insert(busy_wheels_.end(), wheels_of_[body].begin(), wheels_of_[body].end());
  }
  for (auto& joints : busy_joints_) std::sort(joints.begin(), joints.end());
  std::sort(busy_wheels_.begin(), busy_wheels_.end());
}

// A mover continues along its path; Bullet leaves its pose unchanged.
void PhysicsWorld::Impl::advance(btRigidBody& mover, double substep_s) {
  btTransform next;
  btTransformUtil::integrateTransform(mover.getWorldTransform(), mover.getLinearVelocity(),
                                      mover.getAngularVelocity(), substep_s, next);
  mover.setWorldTransform(next);
}

// Bodies that feel the wind do not fall asleep: it may rise.
void PhysicsWorld::Impl::set_wind(const Vec3& wind) {
  wind_ = wind;
  if (!world_.environment.wind.pushes || wind_ == Vec3::Zero()) return;
  for (const RigidBody& rigid : rigid_.bodies) {
    if (rigid.wind_mass > 0.0 && !rigid.info.moved && !rigid.info.gone) wake(rigid.info.body);
  }
}

// The approximation of Gazebo's WindEffects: proportional to the mass exposed, and to the
// difference in velocity.
void PhysicsWorld::Impl::blow(int pace) {
  if (!world_.environment.wind.pushes) return;
  const double gain = world_.environment.wind.gain;
  for (const BodyIndex i : busy_) {
    const RigidBody& rigid = rigid_.bodies[i];
    if (rigid.wind_mass == 0.0 || rigid.info.moved || rigid.info.gone) continue;
    if (!motions_[i].simulated || motions_[i].fine != (pace == kFine)) continue;
    const btVector3 at = rigid.bullet->getWorldTransform().getBasis() * to_bt(rigid.wind_center);
    const Vec3 missing = wind_ - from_bt(rigid.bullet->getVelocityInLocalPoint(at));
    rigid.bullet->applyForce(to_bt(Vec3(gain * rigid.wind_mass * missing)), at);
  }
}

void PhysicsWorld::Impl::before_substep(int pace, double substep_s) {
  blow(pace);
  for (const JointIndex i : busy_joints_[pace]) {
    if (!leaders_[i].valid()) continue;
    const JointConstraint& leader = joints_[leaders_[i]];
    joints_[i].follow(leader.position(), leader.velocity(), substep_s);
  }
  for (const JointIndex i : busy_joints_[pace]) joints_[i].before_substep(substep_s);
  if (pace == kFine) {
    for (const WheelJointIndex i : busy_wheels_) wheels_[i].before_substep(substep_s);
  }
}

void PhysicsWorld::Impl::after_substep(int pace, double substep_s) {
  for (const JointIndex i : busy_joints_[pace]) joints_[i].after_substep(substep_s);
  if (pace == kFine) {
    for (const WheelJointIndex i : busy_wheels_) wheels_[i].after_substep(substep_s);
  }
}

BodyIndex PhysicsWorld::Impl::body_of(JointIndex joint) const {
  const auto& placed = layout_.joints[joint];
  const BodyIndex child = placed.child_body;
  return child.valid() && !rigid_.bodies[child].info.moved ? child : placed.parent_body;
}

void PhysicsWorld::Impl::step_at(int pace) {
  std::vector<btRigidBody*>& bodies = simulated_[pace];
  if (bodies.empty()) return;
  std::vector<std::pair<btRigidBody*, btTransform>>& movers = movers_;
  movers.clear();
  for (const BodyIndex i : busy_) {
    if (!motions_[i].simulated || !rigid_.bodies[i].info.moved) continue;
    btRigidBody& mover = *rigid_.bodies[i].bullet;
    bodies.push_back(&mover);
    movers.emplace_back(&mover, mover.getWorldTransform());
  }
  dynamics_.set_bodies(bodies);
  const double substep_s = static_cast<double>(step_us_) * 1e-6 / substeps_[pace];
  for (int s = 0; s < substeps_[pace]; ++s) {
    before_substep(pace, substep_s);
    dynamics_.substep(substep_s);
    bound_speeds(bodies);
    after_substep(pace, substep_s);
    contacts_.add(dynamics_.manifolds(), s + 1 == substeps_[pace]);
    for (auto& [mover, start] : movers) advance(*mover, substep_s);
  }
  for (auto& [mover, start] : movers)
    mover->setWorldTransform(start);  // the other substep length starts there, too
}

// Contacts between bodies at rest stay as they were when these came to rest.
void PhysicsWorld::Impl::begin_contacts() {
  const auto awake = [this](BodyIndex body) {
    return body.valid() && motions_[body].listed && !rigid_.bodies[body].info.moved;
  };
  const auto gone = [this](BodyIndex body) {
    return body.valid() && rigid_.bodies[body].info.gone;
  };
  const auto rests = [&](const Contact& contact) {
    return !awake(contact.body_a) && !awake(contact.body_b) && !gone(contact.body_a) &&
           !gone(contact.body_b);
  };
  bool any_woke = false;
  for (const auto* bodies : {&busy_, &considered_})
    for (const BodyIndex i : *bodies) any_woke |= contacts_.rests(i) && (awake(i) || gone(i));
  contacts_.begin(static_cast<double>(step_us_) * 1e-6, any_woke, rests);
}

void PhysicsWorld::Impl::step() {
  for (const BodyIndex i : busy_) last_twists_[i] = twists_[i];
  choose_simulated();
  begin_contacts();
  step_at(kCoarse);
  step_at(kFine);
  contacts_.finish();
  for (const BodyIndex i : busy_) {
    BodyMotion& motion = motions_[i];
    const bool moved = rigid_.bodies[i].info.moved;
    if (motion.simulated && !moved && (motion.awake || !sleeping(i))) pull_from_bullet(i);
    if (motion.kind == BodyMotion::Kind::guided && (moved || contacts_.touching(i).empty())) {
      poses_[i] = motion.end;
      twists_[i] = motion.mean;
      motion.dirty = true;
    }
    motion.kind = BodyMotion::Kind::free;
    motion.fresh = false;
  }
  any_fresh_ = false;
  considered_.insert(considered_.end(), busy_.begin(), busy_.end());
  changes_.add_state(considered_);
}

// Forces that are all allowed can together accelerate a light body without bound, and fast bodies
// drag others along: unbounded, numbers would grow to infinity from substep to substep. Bullet is
// never given a value that is not finite.
void PhysicsWorld::Impl::bound_speeds(const std::vector<btRigidBody*>& bodies) {
  constexpr double kFastest2 = quantity::kSpeed.most * quantity::kSpeed.most;
  const auto bounded = [](const btVector3& v) {
    return v.length2() <= kFastest2 ? v : v * (quantity::kSpeed.most / v.length());
  };
  for (btRigidBody* body : bodies) {
    const btVector3 &linear = body->getLinearVelocity(), &angular = body->getAngularVelocity(),
                    &at = body->getWorldTransform().getOrigin();
    if (!std::isfinite(linear.length2() + angular.length2() + at.length2())) {
      throw StateError("the state of the body '" + layout_.bodies[info_of(*body).body].name +
                       "' is not finite: the run ends with the step before. Masses, inertias and "
                       "efforts that do not fit each other do this");
    }
    if (linear.length2() > kFastest2) body->setLinearVelocity(bounded(linear));
    if (angular.length2() > kFastest2) body->setAngularVelocity(bounded(angular));
  }
}

void PhysicsWorld::Impl::set_support(BodyIndex body, Support support) {
  RigidBody& rigid = rigid_.bodies[body];
  const bool plane = support == Support::plane;
  if (rigid.info.on_plane == plane) return;
  stir(body);
  rigid.info.on_plane = plane;
  rigid.bullet->setLinearFactor(plane ? btVector3(1, 1, 0) : btVector3(1, 1, 1));
  rigid.bullet->setAngularFactor(plane ? btVector3(0, 0, 1) : btVector3(1, 1, 1));
  broadphase_.refilter(rigid.bullet->getBroadphaseHandle(), &dispatcher_);
}

void PhysicsWorld::Impl::apply_impulse(BodyIndex body, const Vec3& linear, const Vec3& angular) {
  if (motions_[body].dirty) push_to_bullet(body);
  wake(body);
  bullet(body).applyCentralImpulse(to_bt(linear));
  bullet(body).applyTorqueImpulse(to_bt(angular));
  const Pose pose = poses_[body];
  pull_from_bullet(body);
  poses_[body] = pose;
}

void PhysicsWorld::Impl::sleep(BodyIndex body) {
  stir(body);
  twists_[body] = Twist{};
  push_to_bullet(body);
  bullet(body).setActivationState(ISLAND_SLEEPING);
}

// The mean over a step is that in its middle, half a step ago. A vehicle's turns with it.
void PhysicsWorld::Impl::turn_accelerations(Snapshot& snapshot) const {
  const double half_step_s = 0.5e-6 * static_cast<double>(step_us_);
  for (const world::RobotPlacement& robot : layout_.robots) {
    if (!robot.body.valid() || !world_.models[robot.instance].model->drive) continue;
    Vec3& acceleration = snapshot.body_accelerations[robot.body];
    acceleration = about_z(half_step_s * twists_[robot.body].angular.z()) * acceleration;
  }
}

void PhysicsWorld::Impl::read_body(BodyIndex i, Snapshot& snapshot) const {
  const double step_s = static_cast<double>(step_us_) * 1e-6;
  snapshot.bodies[i] = poses_[i];
  snapshot.body_twists[i] = twists_[i];
  snapshot.body_accelerations[i] = (twists_[i].linear - last_twists_[i].linear) / step_s;
  if (motions_[i].fresh && !motions_[i].tied && !mechanism_in_the_air(i).empty())
    snapshot.body_accelerations[i] = from_bt(rigid_.bodies[i].bullet->getGravity());
  for (const JointIndex joint : joints_of_[i]) read_joint(joint, snapshot);
}

void PhysicsWorld::Impl::read_joint(JointIndex i, Snapshot& snapshot) const {
  snapshot.joint_positions[i] = joints_[i].position();
  snapshot.joint_velocities[i] = joints_[i].velocity();
  snapshot.joint_efforts[i] = joints_[i].effort();
}

void PhysicsWorld::Impl::read(Snapshot& snapshot) {
  snapshot.bodies.resize(poses_.size());
  snapshot.body_twists.resize(poses_.size());
  snapshot.body_accelerations.resize(poses_.size());
  snapshot.joint_positions.resize(joints_.size());
  snapshot.joint_velocities.resize(joints_.size());
  snapshot.joint_efforts.resize(joints_.size());
  const bool known =
      changes_.for_each_since(snapshot.source, [&](BodyIndex body) { read_body(body, snapshot); });
  if (known) {
    for (const BodyIndex body : busy_) read_body(body, snapshot);  // also changed since the step
  } else {
    for (const BodyIndex i : poses_.indices()) read_body(i, snapshot);
    for (const JointIndex i : joints_.indices()) read_joint(i, snapshot);
  }
  snapshot.source = changes_.source();
  snapshot.moving.reserve(3 * poses_.size());
  snapshot.moving = considered_;  // the last step's, and what was changed since
  snapshot.moving.insert(snapshot.moving.end(), busy_.begin(), busy_.end());
  std::sort(snapshot.moving.begin(), snapshot.moving.end());
  snapshot.moving.erase(std::unique(snapshot.moving.begin(), snapshot.moving.end()),
                        snapshot.moving.end());
  turn_accelerations(snapshot);
  if (any_fresh_) accelerate_at_start(snapshot);
  snapshot.contacts.moving().reserve(contacts_.room());
  snapshot.contacts.moving() = contacts_.all();
  snapshot.contacts.set_resting(contacts_.at_rest());
}

}  // namespace ruedo::physics
