// Adds and removes instances between two steps.
//
// Removed things keep their place in the lists, so that numbers do not change; the broadphase
// refuses all their pairs, and no step considers them. The same model may be put into that place
// again.
#include "physics/physics_world_impl.h"

namespace ruedo::physics {

void PhysicsWorld::Impl::disturb(BodyIndex body) {
  btRigidBody& itself = bullet(body);
  broadphase_.for_each_partner(itself.getBroadphaseHandle(), [this](btCollisionObject& partner) {
    const BodyIndex near = info_of(partner).body;
    if (near.valid()) wake(near);
  });
  wake(body);
}

void PhysicsWorld::Impl::refilter_all() {
  for (RigidBody& rigid : rigid_.bodies)
    broadphase_.refilter(rigid.bullet->getBroadphaseHandle(), &dispatcher_);
}

void PhysicsWorld::Impl::add_static(StaticObject& object) {
  dynamics_.addCollisionObject(&object.bullet, btBroadphaseProxy::StaticFilter,
                               btBroadphaseProxy::AllFilter ^ btBroadphaseProxy::StaticFilter);
}

void PhysicsWorld::Impl::add(InstanceIndex instance) {
  const auto is_of = [instance](const ObjectInfo& info) { return info.instance == instance; };
  bool again = false, has_statics = false;
  for (const auto& object : rigid_.statics) again |= is_of(object->info);
  for (const RigidBody& rigid : rigid_.bodies) again |= is_of(rigid.info);
  const BodyIndex first = rigid_.bodies.next();
  if (!again) rigid_.append(world_, layout_, instance);

  for (const auto& object : rigid_.statics) {
    if (!is_of(object->info)) continue;
    object->info.gone = false;
    const auto& link = layout_.links[object->info.shapes.front().link];
    const auto& collision = world_.models[instance]
                                .model->links[link.link]
                                .collisions[object->info.shapes.front().collision];
    object->bullet.setWorldTransform(to_bt((link.X_BL * collision.X_LC).normalized()));
    add_static(*object);
    has_statics = true;
  }
  for (BodyIndex i = first; rigid_.bodies.has(i); ++i) {
    motions_.emplace_back();
    poses_.push_back(layout_.bodies[i].X_WB.normalized());
    twists_.emplace_back();
    last_twists_.emplace_back();
  }
  contacts_.resize(rigid_.bodies.size());
  for (const BodyIndex i : rigid_.bodies.indices()) {
    if (is_of(rigid_.bodies[i].info)) reset_body(i);
  }
  add_joints(instance);
  for (BodyIndex i = first; rigid_.bodies.has(i); ++i) {
    dynamics_.addRigidBody(rigid_.bodies[i].bullet.get(), btBroadphaseProxy::DefaultFilter,
                           btBroadphaseProxy::AllFilter);
  }
  for (const BodyIndex i : rigid_.bodies.indices()) {
    if (!is_of(rigid_.bodies[i].info)) continue;
    update_box(i);
    broadphase_.refilter(bullet(i).getBroadphaseHandle(), &dispatcher_);
  }
  if (has_statics) refilter_all();
  list_joints();
  renew();
}

// Resets it to a new body at the layout's pose.
void PhysicsWorld::Impl::reset_body(BodyIndex body) {
  RigidBody& rigid = rigid_.bodies[body];
  rigid.info.gone = rigid.info.on_plane = false;
  rigid.info.joined.clear();
  motions_[body] = {};
  poses_[body] = layout_.bodies[body].X_WB.normalized();
  twists_[body] = last_twists_[body] = {};
  rigid.bullet->setLinearFactor({1, 1, 1});
  rigid.bullet->setAngularFactor(btVector3(1, 1, 1));
  rigid.bullet->setGravity(to_bt(rigid.gravity));
  push_to_bullet(body);
  rigid.bullet->clearForces();
  wake(body);
}

void PhysicsWorld::Impl::add_joints(InstanceIndex instance) {
  const auto again = [&](JointConstraint& joint, ModelJointIndex joint_of_model) {
    std::destroy_at(&joint);
    std::construct_at(&joint, make_joint(instance, joint_of_model));
    if (joint.constraint()) dynamics_.addConstraint(joint.constraint(), true);
  };
  for (const JointIndex i : joints_.indices()) {
    if (layout_.joints[i].instance == instance) again(joints_[i], layout_.joints[i].joint);
  }
  for (const WheelIndex i : wheel_joint_.indices()) {
    const auto& wheel = layout_.wheels[i];
    if (wheel_joint_[i].valid() && layout_.robots[wheel.robot].instance == instance)
      again(wheels_[wheel_joint_[i]], wheel.joint);
  }
  const JointIndex first_joint = joints_.next();
  const WheelJointIndex first_wheel = wheels_.next();
  add_joints();
  for (JointIndex i = first_joint; joints_.has(i); ++i)
    if (joints_[i].constraint()) dynamics_.addConstraint(joints_[i].constraint(), true);
  for (WheelJointIndex i = first_wheel; wheels_.has(i); ++i)
    if (wheels_[i].constraint()) dynamics_.addConstraint(wheels_[i].constraint(), true);
}

void PhysicsWorld::Impl::remove(InstanceIndex instance) {
  const auto is_of = [instance](const ObjectInfo& info) { return info.instance == instance; };
  for (const BodyIndex i : rigid_.bodies.indices()) {
    RigidBody& rigid = rigid_.bodies[i];
    bool neighbour = is_of(rigid.info);
    broadphase_.for_each_partner(
        rigid.bullet->getBroadphaseHandle(),
        [&](btCollisionObject& partner) { neighbour |= is_of(info_of(partner)); });
    if (neighbour && !rigid.info.gone) wake(i);
  }
  const auto let_go = [&](JointConstraint& joint) {
    if (joint.constraint() && joint.constraint()->isEnabled())
      dynamics_.removeConstraint(joint.constraint());
    joint.disable();
  };
  for (const JointIndex i : joints_.indices())
    if (layout_.joints[i].instance == instance) let_go(joints_[i]);
  for (const WheelIndex i : wheel_joint_.indices()) {
    if (wheel_joint_[i].valid() && layout_.robots[layout_.wheels[i].robot].instance == instance)
      let_go(wheels_[wheel_joint_[i]]);
  }
  for (const TieIndex i : ties_.indices()) {
    const auto of_it = [&](BodyIndex body) {
      return body.valid() && is_of(rigid_.bodies[body].info);
    };
    if (of_it(ties_[i].body) || of_it(ties_[i].other)) open_tie(i);
  }
  bool has_statics = false;
  for (const auto& object : rigid_.statics) {
    if (!is_of(object->info)) continue;
    object->info.gone = true;
    has_statics = true;
  }
  for (const BodyIndex i : rigid_.bodies.indices()) {
    RigidBody& rigid = rigid_.bodies[i];
    if (!is_of(rigid.info)) continue;
    rigid.info.gone = true;
    twists_[i] = last_twists_[i] = {};
    broadphase_.refilter(rigid.bullet->getBroadphaseHandle(), &dispatcher_);
  }
  if (!has_statics) return;
  refilter_all();  // no pair may refer to them once their boxes are gone
  for (const auto& object : rigid_.statics) {
    if (!is_of(object->info)) continue;
    broadphase_.destroyProxy(object->bullet.getBroadphaseHandle(), &dispatcher_);
    object->bullet.setBroadphaseHandle(nullptr);
  }
}

}  // namespace ruedo::physics
