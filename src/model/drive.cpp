// <ruedo:drive> and <ruedo:odometry>, with what they leave out taken from the wheels' joints and shapes.
#include "model/drive.h"

#include <algorithm>
#include <cmath>

#include "model/geometry.h"
#include "model/sdf_link.h"

namespace ruedo::model {
namespace {

constexpr double kStandardGravity = 9.80665;    // m/s^2

int joint_of(const Element& element, const Model& model) {
  const std::string name = dotted(element.text);
  std::vector<std::string> names;
  for (size_t i = 0; i < model.joints.size(); ++i) {
    const Joint& joint = model.joints[i];
    // Gazebo's plugins also take "MODEL::JOINT".
    if (joint.name == name || model.name + "." + joint.name == name) {
      if (joint.type != JointType::revolute && joint.type != JointType::continuous) {
        element.fail("the joint '" + name + "' does not turn; a wheel's joint is revolute or continuous");
      }
      return static_cast<int>(i);
    }
    names.push_back(joint.name);
  }
  const std::string near = nearest_word(name, names);
  element.fail("there is no joint '" + name + "' in the model '" + model.name + "'" +
               (near.empty() ? "" : "; did you mean '" + near + "'?"));
}

// The radius of the wheel on a joint: of the round shapes of its link and of the links fixed to it, across the
// axis; 0 when there is none.
double radius_of(const Model& model, const Joint& joint) {
  std::vector<int> links{joint.child};
  for (size_t i = 0; i < links.size(); ++i) {
    for (const Joint& other : model.joints) {
      if (other.type == JointType::fixed && other.parent == links[i]) links.push_back(other.child);
    }
  }
  double radius = 0;
  const Vec3 axis_M = joint.X_MJ.rotation * joint.axis.axis_in_J;
  for (const int index : links) {
    const Link& link = model.links[static_cast<size_t>(index)];
    for (const Collision& c : link.collisions) {
      const Geometry& g = c.geometry;
      if (g.shape == Shape::cylinder || g.shape == Shape::sphere || g.shape == Shape::capsule) {
        radius = std::max(radius, g.size.x());
      } else if (g.shape == Shape::mesh) {
        const Pose X_MC = link.X_ML * c.X_LC;
        for (const auto& p : g.mesh->positions) {
          const Vec3 arm = X_MC * g.scale.cwiseProduct(p.cast<double>()) - joint.X_MJ.translation;
          radius = std::max(radius, (arm - arm.dot(axis_M) * axis_M).norm());
        }
      }
    }
  }
  return radius;
}

Vec3 middle(const Model& model, const std::vector<int>& joints) {
  Vec3 sum = Vec3::Zero();
  for (const int joint : joints) sum += model.joints[static_cast<size_t>(joint)].X_MJ.translation;
  return sum / static_cast<double>(joints.size());
}

// x ahead, with the left wheels to the left. Wheels named the other way round (some robots have that) keep the
// model's own x ahead.
Quat heading_of(const Vec3& left, const Vec3& right, DriveDescription& drive, const Element& element) {
  Vec3 across = left - right;
  across.z() = 0;
  if (!(across.norm() > 1e-6)) element.fail("the left and the right wheels are in one place");
  across.normalize();
  Vec3 ahead = across.cross(Vec3::UnitZ());
  if (ahead.x() < -0.5) {
    std::swap(drive.left_joints, drive.right_joints);
    ahead = -ahead;
  }
  return Quat(Eigen::AngleAxisd(std::atan2(ahead.y(), ahead.x()), Vec3::UnitZ()));
}

// Front first, whatever the order in the file.
void sort_by_front(const Model& model, const Pose& X_MBase, std::vector<int>& joints) {
  const Pose X_BaseM = X_MBase.inverse();
  std::stable_sort(joints.begin(), joints.end(), [&](int a, int b) {
    return (X_BaseM * model.joints[static_cast<size_t>(a)].X_MJ.translation).x() >
           (X_BaseM * model.joints[static_cast<size_t>(b)].X_MJ.translation).x() + 1e-9;
  });
}

void read_servo(const Element& e, DriveDescription& drive) {
  const Allowed not_negative = Allowed::not_negative(), limit = Allowed::positive().or_infinite();
  drive.servo_rate_gain = e.number("ruedo:servo_rate_gain", 0.0, not_negative);
  drive.servo_angle_gain = e.number("ruedo:servo_angle_gain", 0.0, not_negative);
  drive.gear = e.number("ruedo:gear", drive.gear, Allowed::positive());
  drive.stall_torque = e.number("ruedo:stall_torque", drive.stall_torque, limit);
  drive.no_load_rate = e.number("ruedo:no_load_rate", drive.no_load_rate, limit);
  drive.yaw_gain = e.number("ruedo:yaw_gain", 0.0, not_negative);
  drive.gyro_bias = e.number("ruedo:gyro_bias", 0.0, Allowed::any());
  drive.gyro_scale_error = e.number("ruedo:gyro_scale_error", 0.0, {-1.0, 1.0, true});
}

// The sensor reads the rest, and says what is wrong with these.
void read_odometry(const Element& odometry, DriveDescription& drive) {
  drive.odometry_rate = odometry.rate("ruedo:rate", drive.odometry_rate);
  if (const Element* errors = odometry.child("ruedo:radius_error")) {
    const std::vector<double> values = errors->as_numbers();
    for (size_t side : {0u, 1u}) {
      if (values.size() == 2 && values[side] > -1.0) drive.radius_error[side] = values[side];
    }
  }
  drive.track_error = odometry.number("ruedo:track_error", 0.0, {-1.0, std::numeric_limits<double>::infinity(), true});
}

}  // namespace

const std::vector<std::string>& drive_elements() {
  static const std::vector<std::string> names = {
      "ruedo:left_joint", "ruedo:right_joint", "ruedo:wheel_radius", "ruedo:track", "ruedo:base", "ruedo:max_speed",
      "ruedo:max_turn_rate", "ruedo:acceleration", "ruedo:deceleration", "ruedo:turn_acceleration", "ruedo:max_force",
      "ruedo:max_wheel_torque", "ruedo:max_wheel_rate", "ruedo:watchdog", "ruedo:pose_rate", "ruedo:status_rate",
      "ruedo:traction", "ruedo:primitives", "ruedo:servo_rate_gain", "ruedo:servo_angle_gain", "ruedo:gear", "ruedo:stall_torque",
      "ruedo:no_load_rate", "ruedo:yaw_gain", "ruedo:gyro_bias", "ruedo:gyro_scale_error"};
  return names;
}

const std::vector<std::string>& odometry_elements() {
  static const std::vector<std::string> names = {
      "ruedo:rate", "ruedo:integrator", "ruedo:ticks_per_turn", "ruedo:counter_bits", "ruedo:radius_error",
      "ruedo:track_error", "ruedo:slip_noise", "ruedo:phase"};
  return names;
}

DriveDescription read_drive(std::shared_ptr<const Element> element, std::shared_ptr<const Element> odometry, const Model& model) {
  const Element& e = *element;
  e.refuse_unknown(drive_elements(), false);
  DriveDescription drive;
  const std::string* type = e.attribute("type");
  if (type && *type != "kinematic" && *type != "wheels") e.fail("type '" + *type + "' is not allowed; allowed are kinematic and wheels");
  if (type && *type == "wheels") drive.kind = DriveDescription::Kind::wheels;
  for (const Element* joint : e.all("ruedo:left_joint")) drive.left_joints.push_back(joint_of(*joint, model));
  for (const Element* joint : e.all("ruedo:right_joint")) drive.right_joints.push_back(joint_of(*joint, model));
  if (drive.left_joints.empty()) e.fail("has no <ruedo:left_joint>");
  if (drive.right_joints.empty()) e.fail("has no <ruedo:right_joint>");
  for (const int joint : drive.left_joints) {
    if (std::find(drive.right_joints.begin(), drive.right_joints.end(), joint) != drive.right_joints.end()) {
      e.fail("the joint '" + model.joints[static_cast<size_t>(joint)].name + "' is left and right");
    }
  }

  const Allowed positive = Allowed::positive(), limit = Allowed::positive().or_infinite();
  const double found_radius = radius_of(model, model.joints[static_cast<size_t>(drive.left_joints[0])]);
  if (!e.has("ruedo:wheel_radius") && found_radius <= 0) e.fail("has no <ruedo:wheel_radius>, and the wheel has no collision shape to take it from");
  drive.wheel_radius = e.number("ruedo:wheel_radius", found_radius, positive);

  const Vec3 left = middle(model, drive.left_joints), right = middle(model, drive.right_joints);
  const Quat ahead = heading_of(left, right, drive, e);
  const Vec3 across = left - right;
  drive.track = e.number("ruedo:track", std::hypot(across.x(), across.y()), positive);
  drive.X_MBase = {ahead, (left + right) / 2 - Vec3(0, 0, drive.wheel_radius)};
  drive.X_MBase = e.pose("ruedo:base", drive.X_MBase);
  sort_by_front(model, drive.X_MBase, drive.left_joints);
  sort_by_front(model, drive.X_MBase, drive.right_joints);

  drive.max_speed = e.number("ruedo:max_speed", drive.max_speed, limit);
  drive.max_turn_rate = e.number("ruedo:max_turn_rate", drive.max_turn_rate, limit);
  drive.acceleration = e.number("ruedo:acceleration", drive.acceleration, limit);
  drive.deceleration = e.number("ruedo:deceleration", drive.acceleration, limit);
  drive.turn_acceleration = e.number("ruedo:turn_acceleration", drive.turn_acceleration, limit);
  double mass = 0;
  for (const Link& link : model.links) mass += link.inertial.mass;
  drive.max_force = e.number("ruedo:max_force", mass * kStandardGravity, limit);
  drive.max_wheel_torque = e.number("ruedo:max_wheel_torque", drive.max_wheel_torque, limit);
  drive.max_wheel_rate = e.number("ruedo:max_wheel_rate", drive.max_wheel_rate, limit);
  drive.watchdog_us = std::llround(e.number("ruedo:watchdog", 0.6, Allowed::between(0, 1e6)) * 1e6);
  read_servo(e, drive);
  drive.traction = e.boolean("ruedo:traction", true);
  const bool wheels = drive.kind == DriveDescription::Kind::wheels;
  drive.on_odometry = e.choice("ruedo:primitives", wheels ? "odometry" : "truth", {"truth", "odometry"}) == "odometry";
  if (wheels && !drive.on_odometry) e.child("ruedo:primitives")->fail("'truth' is not allowed with wheels: a robot knows its wheels only; allowed is odometry");
  drive.pose_rate = e.rate("ruedo:pose_rate", drive.pose_rate);
  drive.status_rate = e.rate("ruedo:status_rate", drive.status_rate);
  if (odometry) {
    odometry->refuse_unknown(odometry_elements(), false);
    read_odometry(*odometry, drive);
  }
  drive.element = std::move(element);
  drive.odometry = std::move(odometry);
  return drive;
}

void read_drive_of(const Element& model_element, const std::string& where, ReadContext& context, Model& model) {
  std::shared_ptr<const Element> odometry;
  if (const Element* written = model_element.child("ruedo:odometry")) odometry = written->clone();
  if (const auto drives = model_element.all("ruedo:drive"); !drives.empty()) {
    if (drives.size() > 1) drives[1]->fail("a second drive; a model has one");
    model.drive = read_drive(drives[0]->clone(), odometry, model);
  }
  std::vector<const Element*> plugins;
  collect_plugins(model_element, plugins);
  std::string others;
  const Element* first_other = nullptr;
  for (const Element* plugin : plugins) {
    if (auto translated = drive_from_plugin(*plugin)) {
      if (model.drive) {
        if (model_element.has("ruedo:drive")) continue;    // Ruedo's own element is there instead of it
        context.findings.unsupported(plugin->source, where, "a second drive; the first one is used");
        continue;
      }
      try {
        model.drive = read_drive(std::move(translated), odometry, model);
      } catch (const InputError& error) {
        context.findings.error(error.source(), where, "the drive plugin cannot be used: " + error.message());
      }
      continue;
    }
    model.commanded |= commands_joints(*plugin);
    if (const char* why = unsupported_drive(*plugin); why && !model_element.has("ruedo:drive")) {
      context.findings.unsupported(plugin->source, where, why);
      continue;
    }
    const std::string* file = plugin->attribute("filename");
    const std::string name = file ? *file : "(without a filename)";
    if (others.find(name) != std::string::npos) continue;
    others += (others.empty() ? "" : ", ") + name;
    if (!first_other) first_other = plugin;
  }
  if (first_other) context.findings.unsupported(first_other->source, where, "plugins are not loaded: " + others);
  if (odometry && !model.drive) model_element.child("ruedo:odometry")->fail("needs a drive: the model has no <ruedo:drive>");
  if (odometry && model.drive && !model.drive->odometry) {    // a nested model's drive, odometry given here
    odometry->refuse_unknown(odometry_elements(), false);
    read_odometry(*odometry, *model.drive);
    model.drive->odometry = odometry;
  }
}

}  // namespace ruedo::model
