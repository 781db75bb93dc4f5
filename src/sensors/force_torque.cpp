// A force-torque sensor in any kind of joint, on ROBOT/SENSOR.
//
// Newton-Euler for the carried links: the force of the parent on the child is, summed over the
// links beyond the joint, m (a - g) minus their contact forces; the torque is the corresponding sum
// of moments about the joint's origin. Forces in joints between those links cancel. Accelerations
// are velocity changes over the last step, contacts (normal force and tangential friction, without
// torsional and rolling friction) the mean over it: so the value is a mean, too. If the child is
// held by something without a known force - the world, a path, the kinematic drive - the parent's
// side is used instead; if that is held as well, or the joint is part of a loop, there is no value.
#include <algorithm>
#include "ruedo/bound.h"

#include "ruedo/force_torque_t.hpp"
#include "sensors/mount.h"
#include "world/model/body_layout.h"

namespace ruedo {
namespace {

using world::DriveDescription;
using world::Joint;

std::array<std::string, 6> noise_paths() {
  std::array<std::string, 6> paths;
  for (size_t i = 0; i < 6; ++i) {
    paths[i] =
        std::string("force_torque/") + (i < 3 ? "force/" : "torque/") + "xyz"[i % 3] + "/noise";
  }
  return paths;
}

// The links of a model that remain connected when one joint is cut.
using Side = IndexedVector<ModelLinkIndex, bool>;

Side side(const world::Model& model, ModelLinkIndex link, ModelJointIndex cut) {
  Side in(model.links.size());
  in[link] = true;
  for (bool grown = true; grown;) {
    grown = false;
    for (const ModelJointIndex j : model.joints.indices()) {
      const Joint& joint = model.joints[j];
      if (j == cut || !joint.parent.valid()) continue;
      const ModelLinkIndex a = joint.parent, b = joint.child;
      if (in[a] == in[b]) continue;
      in[a] = in[b] = grown = true;
    }
  }
  return in;
}

class ForceTorque : public SensorOf<ForceTorque> {
 public:
  explicit ForceTorque(const SensorSetup& setup)
      : layout_(setup.layout),
        gravity_(setup.world.gravity),
        noises_(setup, noise_paths()),
        channel_(setup.channel<force_torque_t>()) {
    setup.element.refuse_unknown({"ruedo:phase"});
    const Element* own = setup.element.child("force_torque");
    name_what_does_not_act(setup, own, {"frame", "measure_direction", "force", "torque"});
    frame_ = setup.element.choice("force_torque/frame", "child", {"child", "parent", "sensor"});
    by_parent_ = setup.element.choice("force_torque/measure_direction", "child_to_parent",
                                      {"child_to_parent", "parent_to_child"}) == "parent_to_child";
    instance_ = layout_->links[setup.link].instance;
    model_ = setup.world.models[instance_].model.get();
    find_joint(setup);
    choose_side(setup);
  }

  bool observes() const override { return !weighed_.empty(); }

  void observe(const Snapshot& now, Outbox&) override {
    const bool first = omega_.empty();
    const double dt_s = 1e-6 * static_cast<double>(now.time - time_);
    omega_.resize(now.bodies.size(), Vec3::Zero());
    alpha_.resize(now.bodies.size(), Vec3::Zero());
    for (const BodyIndex body : bodies_) {
      const Vec3& omega = now.body_twists[body].angular;
      alpha_[body] =
          first || dt_s <= 0.0 ? Vec3(Vec3::Zero()) : Vec3((omega - omega_[body]) / dt_s);
      omega_[body] = omega;
    }
    time_ = now.time;
  }

  void sample(const SampleInput& input, Outbox& out) override {
    if (weighed_.empty()) return;
    const Snapshot& now = input.snapshot;
    const Pose X_WC = link_pose(now, child_);
    const Vec3 p_WJ = X_WC * p_CJ_;
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();  // on the side used, world
    for (const LinkIndex link : weighed_) weigh(now, link, p_WJ, force, torque);
    for (const Contact& contact : now.contacts) take_contact(contact, p_WJ, force, torque);
    // So far this is what the other side exerts on this one.
    if (weighs_child_ != by_parent_) force = -force, torque = -torque;
    const Quat R_FW = axes(now, X_WC).conjugate();
    force = R_FW * force;
    torque = R_FW * torque;
    const auto m =
        noises_.apply({force.x(), force.y(), force.z(), torque.x(), torque.y(), torque.z()},
                      now.time, input.sample);
    force_torque_t message;
    message.utime = now.time;
    std::copy(m.begin(), m.begin() + 3, message.force);
    std::copy(m.begin() + 3, m.end(), message.torque);
    out.publish(channel_, message);
  }

  void shift_time(SimTime us) override {
    noises_.shift_time(us);
    time_ -= us;
  }

  void exchange(StateArchive& archive) { archive(noises_, omega_, alpha_, time_); }

 private:
  void find_joint(const SensorSetup& setup) {
    for (const world::SensorDescription& sensor : model_->sensors) {
      if (sensor.name == setup.device) joint_ = sensor.joint;
    }
    if (!joint_.valid()) {  // on a link: in the joint that carries the link
      const ModelLinkIndex link = layout_->links[setup.link].link;
      const auto carries = std::find_if(model_->joints.begin(), model_->joints.end(),
                                        [&](const Joint& joint) { return joint.child == link; });
      if (carries != model_->joints.end())
        joint_ = ModelJointIndex(carries - model_->joints.begin());
    }
    if (!joint_.valid())
      setup.element.fail("a force-torque sensor stands in a <joint>, or on a joint's child");
  }

  // Whether it is held by something without a known force.
  bool held(const Side& in, ModelJointIndex cut) const {
    for (const ModelJointIndex j : model_->joints.indices()) {
      const Joint& joint = model_->joints[j];
      if (j != cut && !joint.parent.valid() && in[joint.child]) return true;
    }
    const bool driven = model_->drive && model_->drive->kind == DriveDescription::Kind::kinematic;
    const DriveDescription* drive = driven ? &*model_->drive : nullptr;
    const bool wheelless = drive && drive->left_joints.empty() && drive->right_joints.empty();
    for (const ModelLinkIndex i : in.indices()) {
      const world::LinkPlacement& link = layout_->links[layout_->link_of(instance_, i)];
      if (!in[i]) continue;
      if (model_->is_static || model_->links[i].kinematic) return true;
      if (driven && (link.wheel.valid() || (wheelless && i == 0))) return true;
    }
    return false;
  }

  void choose_side(const SensorSetup& setup) {
    const Joint& joint = model_->joints[joint_];
    child_ = layout_->link_of(instance_, joint.child);
    if (joint.parent.valid()) parent_ = layout_->link_of(instance_, joint.parent);
    const Pose& X_MC = model_->links[joint.child].X_ML;
    p_CJ_ = (X_MC.inverse() * joint.X_MJ).translation;
    X_CS_ = setup.X_LS;
    const Side with_child = side(*model_, joint.child, joint_);
    const bool loop = joint.parent.valid() && with_child[joint.parent];
    if (!loop && !held(with_child, joint_)) {
      take_side(with_child, true);
    } else if (!loop && joint.parent.valid()) {
      const Side with_parent = side(*model_, joint.parent, joint_);
      if (!held(with_parent, joint_)) take_side(with_parent, false);
    }
    if (weighed_.empty() && setup.findings) {
      setup.findings->unsupported(
          setup.element.source, "sensor " + setup.device,
          loop ? "its joint is part of a loop of joints: it has no value"
               : "the forces of what holds both sides of its joint are not known: it has no value");
    }
  }

  void take_side(const Side& in, bool child) {
    weighs_child_ = child;
    for (const ModelLinkIndex i : in.indices()) {
      if (!in[i]) continue;
      weighed_.push_back(layout_->link_of(instance_, i));
      const BodyIndex body = layout_->links[weighed_.back()].body;
      if (body.valid() && std::find(bodies_.begin(), bodies_.end(), body) == bodies_.end())
        bodies_.push_back(body);
    }
  }

  Pose link_pose(const Snapshot& now, LinkIndex link) const {
    const world::LinkPlacement& placement = layout_->links[link];
    if (!placement.body.valid()) return placement.X_BL;
    return now.bodies[placement.body] * layout_->link_in_body(link, now.wheel_angles);
  }

  Quat axes(const Snapshot& now, const Pose& X_WC) const {
    if (frame_ == "sensor") return X_WC.rotation * X_CS_.rotation;
    if (frame_ == "child") return X_WC.rotation;
    return parent_.valid() ? link_pose(now, parent_).rotation : Quat::Identity();
  }

  // Adds the force that a link's motion requires, against gravity.
  void weigh(const Snapshot& now, LinkIndex link, const Vec3& p_WJ, Vec3& force,
             Vec3& torque) const {
    const world::LinkPlacement& placement = layout_->links[link];
    const world::Link& described = model_->links[placement.link];
    const Pose X_WI = link_pose(now, link) * described.inertial.X_LI;
    Vec3 a = Vec3::Zero(), omega = Vec3::Zero(), alpha = Vec3::Zero();
    if (placement.body.valid()) {  // otherwise it is fixed to the world
      const BodyIndex body = placement.body;
      const Vec3 arm = X_WI.translation - now.bodies[body].translation;
      omega = omega_[body];
      alpha = alpha_[body];
      a = now.body_accelerations[body] + alpha.cross(arm) + omega.cross(omega.cross(arm));
    }
    if (described.gravity) a -= gravity_;
    const Vec3 f = described.inertial.mass * a;
    const Eigen::Matrix3d R = X_WI.rotation.toRotationMatrix();
    const Eigen::Matrix3d inertia = R * described.inertial.inertia * R.transpose();
    force += f;
    torque += (X_WI.translation - p_WJ).cross(f) + inertia * alpha + omega.cross(inertia * omega);
  }

  // Subtracts the contact forces on the links of that side.
  void take_contact(const Contact& contact, const Vec3& p_WJ, Vec3& force, Vec3& torque) const {
    const Vec3 on_a = contact.force * contact.normal + contact.friction;
    for (const LinkIndex link : weighed_) {
      const double sign = (contact.link_a == link) - (contact.link_b == link);
      if (sign == 0.0) continue;
      force -= sign * on_a;
      torque -= (contact.position - p_WJ).cross(sign * on_a);
    }
  }

  Bound<const world::BodyLayout> layout_;
  const world::Model* model_ = nullptr;
  Vec3 gravity_;
  Noises<6> noises_;
  int channel_;
  std::string frame_;
  bool by_parent_ = false;
  InstanceIndex instance_;
  ModelJointIndex joint_;
  LinkIndex child_, parent_;  // parent: none is the world
  Vec3 p_CJ_ = Vec3::Zero();  // the joint's origin, in the child
  Pose X_CS_;
  bool weighs_child_ = true;
  std::vector<LinkIndex> weighed_;                // links of the side used; empty: without a value
  std::vector<BodyIndex> bodies_;                 // their bodies
  IndexedVector<BodyIndex, Vec3> omega_, alpha_;  // world
  SimTime time_ = 0;
};

const RegisterSensor kRegister{
    {.module = "instruments",
     .order = 7,
     .types = {"force_torque"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {100, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<ForceTorque>(setup); },
     .kind = "force_torque"}};

}  // namespace
}  // namespace ruedo
