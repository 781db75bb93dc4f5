// Mass properties and compound shapes. Inertias of the links are combined about the common centre
// of mass (parallel axes).
#include "physics/bodies/rigid_bodies.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "physics/joints/simplifications.h"

namespace ruedo::physics {

namespace {

constexpr double kSmallestMass_kg = 1e-6;
// Radius of gyration about any axis: with a smaller one, a torque could produce any angular rate.
// At most this part of the shapes' size.
constexpr double kSmallestGyration_m = 1e-3, kSmallestGyration = 0.05;
// Driven wheels: the tyre is compressed by about this much by the robot's weight, which distributes
// the weight over all wheels (four rigid wheels on a rigid floor stand on any two or three).
constexpr double kTyreGives_m = 5e-4, kTyreDamping = 1.0;
// Velocities below which a body may fall asleep, after 2 s.
constexpr double kSleepSpeed_m_s = 0.005, kSleepRate_rad_s = 0.01;

struct MassProperties {
  double mass = 0.0;
  Vec3 center = Vec3::Zero();                         // in B
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // about the centre, axes of B
};

MassProperties mass_of(const world::Model& model, const world::BodyLayout& layout,
                       const world::BodyPlacement& body) {
  MassProperties sum;
  for (const LinkIndex index : body.links) {
    const auto& placement = layout.links[index];
    const auto& inertial = model.links[placement.link].inertial;
    sum.mass += inertial.mass;
    sum.center += inertial.mass * (placement.X_BL * inertial.X_LI.translation);
  }
  sum.mass = std::max(sum.mass, kSmallestMass_kg);
  sum.center /= sum.mass;
  for (const LinkIndex index : body.links) {
    const auto& placement = layout.links[index];
    const auto& inertial = model.links[placement.link].inertial;
    const Pose X_BI = placement.X_BL * inertial.X_LI;
    const Eigen::Matrix3d R = X_BI.rotation.toRotationMatrix();
    const Vec3 d = X_BI.translation - sum.center;
    sum.inertia +=
        R * inertial.inertia * R.transpose() +
        inertial.mass * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  }
  return sum;
}

// Principal axes as a rotation; the axes of B if they are principal already, to avoid rounding.
Quat principal_axes(const Eigen::Matrix3d& inertia, Vec3& moments) {
  Eigen::Matrix3d off = inertia;
  off.diagonal().setZero();
  moments = inertia.diagonal();
  if (off.cwiseAbs().maxCoeff() <= 1e-9 * inertia.trace()) return Quat::Identity();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia);
  moments = solver.eigenvalues();
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(2) = -axes.col(2);
  return Quat(axes).normalized();
}

const world::RobotPlacement* robot_of(const world::BodyLayout& layout, InstanceIndex instance) {
  const auto robot = std::lower_bound(
      layout.robots.begin(), layout.robots.end(), instance,
      [](const world::RobotPlacement& a, InstanceIndex b) { return a.instance < b; });
  return robot != layout.robots.end() && robot->instance == instance ? &*robot : nullptr;
}

double mass_on_each_wheel(const world::Model& model, const world::RobotPlacement& robot) {
  double mass = 0.0;
  for (const auto& link : model.links) mass += link.inertial.mass;
  return mass / static_cast<double>(std::max<size_t>(robot.wheels.size(), 1));
}

void make_it_give(double share, const Vec3& gravity, ShapeSurface& surface) {
  surface.stiffness = share * gravity.norm() / kTyreGives_m;
  surface.damping = kTyreDamping * 2.0 * std::sqrt(surface.stiffness * share);
}

bool carries_kinematic_drive(const world::WorldModel& world, const world::BodyLayout& layout,
                             BodyIndex index) {
  for (const auto& robot : layout.robots) {
    if (robot.body != index) continue;
    const auto& drive = world.models[robot.instance].model->drive;
    return drive && drive->kind == world::DriveDescription::Kind::kinematic;
  }
  return false;
}

// Bullet's frame of a wheel: y is its axle, to which lateral friction refers.
Pose wheel_frame(const world::BodyLayout& layout, WheelIndex wheel, const MassProperties& mass,
                 Vec3& moments) {
  const auto& placement = layout.wheels[wheel];
  const Vec3 axis = layout.links[placement.link].X_BL.rotation * placement.axis_in_L;
  const Pose X_BI{Quat::FromTwoVectors(Vec3::UnitY(), axis), mass.center};
  const Eigen::Matrix3d R = X_BI.rotation.toRotationMatrix();
  moments = (R.transpose() * mass.inertia * R).diagonal();
  return X_BI;
}

// Adds a link's mass to the mass exposed to the wind.
void feel_wind(const world::Inertial& inertial, const Pose& X_IB, const Pose& X_BL,
               RigidBody& body) {
  const Vec3 at = X_IB * (X_BL * inertial.X_LI.translation);
  body.wind_mass += inertial.mass;
  body.wind_center += (at - body.wind_center) * (inertial.mass / body.wind_mass);
}

// moments: about the axes of I.
void make_bullet(double mass, const Vec3& moments, const Pose& X_WB, RigidBody& body) {
  const bool kinematic = body.info.moved;
  const double size = body.box_half.norm();
  const double gyration = std::min(kSmallestGyration_m, kSmallestGyration * size);
  const double smallest = size > 0.0 ? mass * gyration * gyration : 1e-9 + 1e-6 * mass;
  btRigidBody::btRigidBodyConstructionInfo settings(
      kinematic ? 0.0 : mass, nullptr, body.compound.get(),
      kinematic ? btVector3(0, 0, 0) : to_bt(Vec3(moments.cwiseMax(smallest))));
  settings.m_startWorldTransform = to_bt((X_WB * body.X_BI).normalized());
  settings.m_linearSleepingThreshold = kSleepSpeed_m_s;
  settings.m_angularSleepingThreshold = kSleepRate_rad_s;
  body.bullet = std::make_unique<btRigidBody>(settings);
  btRigidBody& bullet = *body.bullet;
  if (kinematic)
    bullet.setCollisionFlags(bullet.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  bullet.setFlags(bullet.getFlags() | BT_DISABLE_WORLD_GRAVITY);  // gravity is set per body
  bullet.setGravity(to_bt(body.gravity));
  bullet.setUserPointer(&body.info);
  if (!body.sleeps) bullet.forceActivationState(DISABLE_DEACTIVATION);
  // The farthest that any of it is from its centre of mass.
  bullet.setCcdSweptSphereRadius(size + (body.box_center - body.X_BI.translation).norm());
}

// Of a kinematic drive, which also represents its friction.
bool is_belt(const world::Model& model, ModelLinkIndex link) {
  if (!model.drive || model.drive->kind != world::DriveDescription::Kind::kinematic) return false;
  const auto& belts = model.drive->belts;
  return std::find(belts.begin(), belts.end(), link) != belts.end();
}

}  // namespace

WheelIndex driven_wheel(const world::BodyLayout& layout, BodyIndex index) {
  const world::RobotPlacement* robot = robot_of(layout, layout.bodies[index].instance);
  if (!robot || robot->body == index) return {};
  for (const WheelIndex wheel : robot->wheels) {
    const world::WheelPlacement& placement = layout.wheels[wheel];
    if (!placement.steers && layout.links[placement.link].body == index) return wheel;
  }
  return {};
}

const ObjectInfo::Shape& shape_of(const ObjectInfo& info, int child) {
  static const ObjectInfo::Shape kNone;
  if (info.shapes.empty()) return kNone;
  const bool known =
      info.body.valid() && child >= 0 && static_cast<size_t>(child) < info.shapes.size();
  return known ? info.shapes[child] : info.shapes.front();
}

RigidBodies::RigidBodies(const world::WorldModel& world, const world::BodyLayout& layout)
    : findings(simplifications(world, layout)) {
  for (const LinkIndex link : layout.links.indices()) make_statics(world, layout, link);
  bodies.resize(layout.bodies.size());
  for (const BodyIndex i : bodies.indices()) make_body(world, layout, i);
}

void RigidBodies::append(const world::WorldModel& world, const world::BodyLayout& layout,
                         InstanceIndex instance) {
  const BodyIndex first = bodies.next();
  for (const LinkIndex link : layout.links.indices()) {
    if (layout.links[link].instance == instance) make_statics(world, layout, link);
  }
  bodies.resize(layout.bodies.size());
  for (BodyIndex i(0); i < first; ++i)
    bodies[i].bullet->setUserPointer(&bodies[i].info);  // they may have moved in memory
  for (BodyIndex i = first; bodies.has(i); ++i) make_body(world, layout, i);
}

void RigidBodies::make_statics(const world::WorldModel& world, const world::BodyLayout& layout,
                               LinkIndex index) {
  const auto& placement = layout.links[index];
  if (placement.body.valid()) return;
  const auto& model = *world.models[placement.instance].model;
  const auto& collisions = model.links[placement.link].collisions;
  for (size_t c = 0; c < collisions.size(); ++c) {
    const auto& collision = collisions[c];
    btCollisionShape* shape = shapes_.fixed(collision.geometry);
    if (!shape) continue;
    auto object = std::make_unique<StaticObject>();
    btCollisionObject& bullet = object->bullet;
    bullet.setCollisionShape(shape);
    bullet.setWorldTransform(to_bt((placement.X_BL * collision.X_LC).normalized()));
    bullet.setCollisionFlags(btCollisionObject::CF_STATIC_OBJECT);
    object->info.instance = placement.instance;
    object->info.plane = collision.geometry.shape == world::Shape::plane;
    object->info.shapes.push_back(  // Bullet's frame is the collision's
        {index, ShapeIndex(c), surface_of(collision.surface, Quat::Identity())});
    bullet.setUserPointer(&object->info);
    statics.push_back(std::move(object));
  }
}

// A wheel of a wheels drive: y of its frame is its axle.
ShapeSurface RigidBodies::tyre_of(const world::WorldModel& world, const world::BodyLayout& layout,
                                  WheelIndex wheel, const ShapeSurface& surface) const {
  const auto& robot = layout.robots[layout.wheels[wheel].robot];
  const world::Model& model = *world.models[robot.instance].model;
  ShapeSurface tyre = surface;
  using Steering = world::DriveDescription::Steering;
  const bool rolls_sideways = model.drive && (model.drive->steering == Steering::mecanum ||
                                              model.drive->steering == Steering::omni);
  if (rolls_sideways) {  // it grips along the roller's axis only; the roller rotates freely
    const Vec3& rim = layout.wheels[wheel].rim;
    tyre.along_I.setZero();
    tyre.friction2 = 0.0;
    if (model.drive->steering == Steering::mecanum) tyre.roller_rad = math::atan2(rim.y(), rim.x());
  }
  if (tyre.along_I == Vec3::Zero()) tyre.axle_I = Vec3::UnitY();
  if (tyre.stiffness > 0.0) return tyre;  // the file gives the compliance
  make_it_give(mass_on_each_wheel(model, robot), world.gravity, tyre);
  return tyre;
}

// Other supports of a robot, above all casters, are as compliant as its tyres: rigid ones would
// bear all the weight and leave none for the wheels. Against what it runs into, it stays rigid.
ShapeSurface RigidBodies::foot_of(const world::WorldModel& world, const world::BodyLayout& layout,
                                  InstanceIndex instance, const ShapeSurface& surface) const {
  const world::Model& model = *world.models[instance].model;
  const world::RobotPlacement* robot = robot_of(layout, instance);
  using Kind = world::DriveDescription::Kind;
  if (surface.stiffness > 0.0 || !robot || !model.drive || model.drive->kind != Kind::wheels)
    return surface;
  ShapeSurface foot = surface;
  make_it_give(mass_on_each_wheel(model, *robot), world.gravity, foot);
  if (foot.stiffness > 0.0) foot.borne_along = -world.gravity.normalized();
  return foot;
}

// All collisions of a body as one shape, in Bullet's frame I, with the surface of each.
void RigidBodies::make_compound(const world::WorldModel& world, const world::BodyLayout& layout,
                                WheelIndex wheel, RigidBody& body) {
  const auto& placement = layout.bodies[body.info.body];
  const auto& instance = world.models[placement.instance];
  const Pose X_IB = body.X_BI.inverse();
  // A kinematic drive represents its wheels' friction.
  const bool imposed = carries_kinematic_drive(world, layout, body.info.body);
  body.compound = std::make_unique<BodyShape>();
  std::vector<btCollisionShape*> shapes;
  for (const LinkIndex link_index : placement.links) {
    const auto& link_placement = layout.links[link_index];
    const world::Link& link = instance.model->links[link_placement.link];
    for (size_t c = 0; c < link.collisions.size(); ++c) {
      const auto& collision = link.collisions[c];
      shapes.clear();
      if (wheel.valid() && collision.geometry.shape == world::Shape::cylinder) {
        shapes.push_back(shapes_.tyre(collision.geometry.size.x(), collision.geometry.size.y()));
      } else if (!shapes_.moving(collision.geometry, wheel.valid(), shapes)) {
        findings.push_back(
            {Finding::Kind::unsupported, collision.source,
             "model " + instance.name + "/link " + link.name + "/collision " + collision.name,
             "a concave or open mesh on a body that moves: it collides as " +
                 std::to_string(shapes.size()) + " convex piece(s), " +
                 (collision.geometry.pieces ? "which have more than 5 % more volume"
                                            : "the hulls of its connected parts")});
      }
      const Pose X_IC = (X_IB * link_placement.X_BL * collision.X_LC).normalized();
      for (btCollisionShape* shape : shapes) {
        body.compound->addChildShape(to_bt(X_IC), shape);
        ShapeSurface surface = surface_of(collision.surface, X_IC.rotation);
        surface = wheel.valid() ? tyre_of(world, layout, wheel, surface)
                                : foot_of(world, layout, placement.instance, surface);
        if ((imposed && link_placement.wheel.valid()) ||
            is_belt(*instance.model, link_placement.link))
          surface.friction = surface.friction2 = 0.0;
        body.info.shapes.push_back({link_index, ShapeIndex(c), surface});
      }
    }
  }
}

void RigidBodies::make_body(const world::WorldModel& world, const world::BodyLayout& layout,
                            BodyIndex index) {
  const auto& placement = layout.bodies[index];
  const world::Model& model = *world.models[placement.instance].model;
  RigidBody& body = bodies[index];
  const MassProperties mass = mass_of(model, layout, placement);
  const WheelIndex wheel = driven_wheel(layout, index);
  Vec3 moments;
  body.X_BI = wheel.valid() ? wheel_frame(layout, wheel, mass, moments)
                            : Pose{principal_axes(mass.inertia, moments), mass.center};
  const Pose X_IB = body.X_BI.inverse();
  bool gravity = false, kinematic = model.path != nullptr;
  for (const LinkIndex link_index : placement.links) {
    const auto& link_placement = layout.links[link_index];
    const world::Link& link = model.links[link_placement.link];
    gravity |= link.gravity;
    kinematic |= link.kinematic;
    body.sleeps &= link.sleeps;
    if (link.wind) feel_wind(link.inertial, X_IB, link_placement.X_BL, body);
  }
  body.gravity = gravity && !kinematic ? world.gravity : Vec3(0, 0, 0);
  body.info.body = index;
  body.info.instance = placement.instance;
  body.info.self_collide = model.self_collide;
  body.info.moved = kinematic;
  make_compound(world, layout, wheel, body);
  if (body.compound->getNumChildShapes() > 0) {
    btVector3 low, high;
    body.compound->getAabb(to_bt(X_IB.inverse().normalized()), low, high);
    body.box_center = from_bt((low + high) / 2);
    body.box_half = from_bt((high - low) / 2);
  }
  make_bullet(mass.mass, moments, placement.X_WB, body);
}

}  // namespace ruedo::physics
