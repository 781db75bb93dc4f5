// Writes a robot as URDF. Shapes that URDF lacks (planes, cones, ellipsoids, meshes without a
// file) are left out, with a comment.
#include <filesystem>
#include <limits>

#include <fmt/format.h>

#include "base/xml.h"
#include "bridges/ros2/messages/robot_frames.h"
#include "ruedo/math.h"

namespace ruedo::ros2 {
namespace {

using world::Geometry;
using world::Shape;
using Motion = LinkFrame::Motion;

constexpr double kNoLimit = 1e6;

std::string numbers(const Vec3& v) {
  const auto number = [](double x) { return x == 0.0 ? 0.0 : x; };  // no -0
  return fmt::format("{:.9g} {:.9g} {:.9g}", number(v.x()), number(v.y()), number(v.z()));
}

// Roll, pitch, yaw about fixed axes.
Vec3 rpy_of(const Quat& rotation) {
  const Eigen::Matrix3d R = rotation.toRotationMatrix();
  const double level = std::sqrt(R(0, 0) * R(0, 0) + R(1, 0) * R(1, 0));
  const double pitch = math::atan2(-R(2, 0), level);
  constexpr double kUpright = 1e-9;  // gimbal lock: yaw is set to 0
  if (level < kUpright) return {math::atan2(-R(1, 2), R(1, 1)), pitch, 0.0};
  return {math::atan2(R(2, 1), R(2, 2)), pitch, math::atan2(R(1, 0), R(0, 0))};
}

std::string origin(const Pose& X) {
  return fmt::format("<origin xyz=\"{}\" rpy=\"{}\"/>", numbers(X.translation),
                     numbers(rpy_of(X.rotation)));
}

std::string file_uri(const std::string& path) {
  std::string uri = "file://";
  for (const char c : std::filesystem::absolute(path).lexically_normal().string()) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       std::string_view("/-_.~+").find(c) != std::string_view::npos;
    uri += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return uri;
}

struct Piece {
  Pose X_GP;         // in the frame of the geometry
  std::string text;  // "<box .../>"
};

// None: URDF has no such shape.
std::vector<Piece> pieces_of(const Geometry& geometry) {
  const Vec3& size = geometry.size;
  const auto sphere = [](double radius) {
    return fmt::format("<sphere radius=\"{:.9g}\"/>", radius);
  };
  const std::string cylinder =
      fmt::format("<cylinder radius=\"{:.9g}\" length=\"{:.9g}\"/>", size.x(), size.y());
  switch (geometry.shape) {
    case Shape::box: return {{Pose{}, "<box size=\"" + numbers(size) + "\"/>"}};
    case Shape::sphere: return {{Pose{}, sphere(size.x())}};
    case Shape::cylinder: return {{Pose{}, cylinder}};
    case Shape::capsule: {
      const Vec3 end(0, 0, size.y() / 2);
      return {{Pose{}, cylinder},
              {{Quat::Identity(), end}, sphere(size.x())},
              {{Quat::Identity(), -end}, sphere(size.x())}};
    }
    case Shape::mesh: break;
    default: return {};
  }
  std::error_code error;
  if (!geometry.mesh || !std::filesystem::is_regular_file(geometry.mesh->name, error)) return {};
  return {{Pose{}, "<mesh filename=\"" + xml_escaped(file_uri(geometry.mesh->name)) +
                       "\" scale=\"" + numbers(geometry.scale) + "\"/>"}};
}

// XML comments cannot contain two consecutive hyphens.
std::string left_out(const char* element, const std::string& name) {
  std::string safe;
  for (const char c : xml_escaped(name)) safe += c == '-' ? '_' : c;
  return fmt::format("    <!-- {} {}: URDF has no such shape -->\n", element, safe);
}

std::string colour(const world::Visual& visual, const std::string& name) {
  const bool own = visual.geometry.shape == Shape::mesh;
  if (!visual.material && own) return {};  // the mesh's own
  const world::Rgba rgba =
      visual.material ? visual.material->diffuse : world::Rgba{0.7f, 0.7f, 0.7f, 1.0f};
  return fmt::format(
      "<material name=\"{}\"><color rgba=\"{:.4g} {:.4g} {:.4g} {:.4g}\"/></material>",
      xml_escaped(name), rgba[0], rgba[1], rgba[2], rgba[3] * (1.0 - visual.transparency));
}

std::string inertial(const world::Inertial& inertial, const Pose& X_FL) {
  const auto& I = inertial.inertia;
  return fmt::format(
      "    <inertial>{}<mass value=\"{:.9g}\"/><inertia ixx=\"{:.9g}\" ixy=\"{:.9g}\" "
      "ixz=\"{:.9g}\" iyy=\"{:.9g}\" iyz=\"{:.9g}\" izz=\"{:.9g}\"/></inertial>\n",
      origin(X_FL * inertial.X_LI), inertial.mass, I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2),
      I(2, 2));
}

std::string link_text(const LinkFrame& frame, const world::Model& model) {
  std::string text = "  <link name=\"" + xml_escaped(frame.name) + "\">\n";
  if (!frame.link.valid()) return "  <link name=\"" + xml_escaped(frame.name) + "\"/>\n";
  const world::Link& link = model.links[frame.link];
  const Pose X_FL = frame.X_MF.inverse() * link.X_ML;
  text += inertial(link.inertial, X_FL);
  for (size_t i = 0; i < link.visuals.size(); ++i) {
    const world::Visual& visual = link.visuals[i];
    const std::string material = colour(visual, fmt::format("{}_{}", frame.name, i));
    const std::vector<Piece> pieces = pieces_of(visual.geometry);
    if (pieces.empty()) text += left_out("visual", visual.name);
    for (const Piece& piece : pieces) {
      text += fmt::format("    <visual>{}<geometry>{}</geometry>{}</visual>\n",
                          origin(X_FL * visual.X_LV * piece.X_GP), piece.text, material);
    }
  }
  for (const world::Collision& collision : link.collisions) {
    const std::vector<Piece> pieces = pieces_of(collision.geometry);
    if (pieces.empty()) text += left_out("collision", collision.name);
    for (const Piece& piece : pieces) {
      text += fmt::format("    <collision>{}<geometry>{}</geometry></collision>\n",
                          origin(X_FL * collision.X_LC * piece.X_GP), piece.text);
    }
  }
  return text + "  </link>\n";
}

double bounded(double value) { return std::min(std::max(value, -kNoLimit), kNoLimit); }

std::string limits(const world::JointAxis& axis, bool bounds) {
  const double lower = bounded(axis.lower), upper = bounded(axis.upper);
  return fmt::format("<limit {}effort=\"{:.9g}\" velocity=\"{:.9g}\"/>",
                     bounds ? fmt::format("lower=\"{:.9g}\" upper=\"{:.9g}\" ", lower, upper) : "",
                     bounded(axis.effort), bounded(axis.velocity));
}

std::string moving_joint(const LinkFrame& frame, const world::Model& model) {
  const world::Joint& joint = model.joints[frame.joint];
  const bool endless = std::isinf(joint.axis.lower) && std::isinf(joint.axis.upper);
  const char* type = frame.motion == Motion::slide   ? "prismatic"
                     : frame.motion == Motion::screw ? "floating"
                     : endless                       ? "continuous"
                                                     : "revolute";
  std::string text = fmt::format("  <joint name=\"{}\" type=\"{}\">\n    {}",
                                 xml_escaped(joint.name), type, origin(frame.X_PF));
  if (frame.motion == Motion::screw) return text;
  text += "<axis xyz=\"" + numbers(frame.axis) + "\"/>" +
          limits(joint.axis, frame.motion == Motion::slide || !endless);
  if (joint.leader.valid()) {
    text += fmt::format("<mimic joint=\"{}\" multiplier=\"{:.9g}\" offset=\"{:.9g}\"/>",
                        xml_escaped(model.joints[joint.leader].name), joint.mimic_multiplier,
                        joint.mimic_offset - joint.mimic_multiplier * joint.mimic_reference);
  }
  return text;
}

std::string joint_text(const LinkFrame& frame, const RobotFrames& robot,
                       const world::Model& model) {
  const std::string tied =
      frame.joint.valid() ? model.joints[frame.joint].name : frame.name + "_to_base_link";
  std::string text = frame.motion == Motion::none
                         ? fmt::format("  <joint name=\"{}\" type=\"fixed\">\n    {}",
                                       xml_escaped(tied), origin(frame.X_PF))
                         : moving_joint(frame, model);
  return text + fmt::format("\n    <parent link=\"{}\"/><child link=\"{}\"/>\n  </joint>\n",
                            xml_escaped(robot.frames[frame.parent].name), xml_escaped(frame.name));
}

}  // namespace

std::string urdf_of(const world::Model& model, const RobotFrames& robot) {
  std::string text = "<?xml version=\"1.0\"?>\n<robot name=\"" + xml_escaped(model.name) + "\">\n";
  for (const LinkFrame& frame : robot.frames) text += link_text(frame, model);
  for (size_t i = 1; i < robot.frames.size(); ++i)
    text += joint_text(robot.frames[i], robot, model);
  return text + "</robot>\n";
}

}  // namespace ruedo::ros2
