// <joint>: type, frames, axes and limits.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "world/sdf/sdf_reader.h"

namespace ruedo::world {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void read_limits(const Element& element, const Joint& joint, const std::string& where,
                 Findings& findings, JointAxis& axis) {
  const auto limit = [&](const char* path, double fallback) {
    const double value = element.number(path, fallback, {.infinite = true});
    return std::abs(value) >= 1e16 ? std::copysign(kInfinity, value) : value;
  };
  axis.lower = limit("limit/lower", -kInfinity);
  axis.upper = limit("limit/upper", kInfinity);
  if (joint.type == JointType::continuous) {
    if (axis.lower < axis.upper && (std::isfinite(axis.lower) || std::isfinite(axis.upper)))
      findings.unsupported(element.child("limit")->source, where,
                           "a continuous joint has no limits: those of " + shown(axis.lower) +
                               " to " + shown(axis.upper) + " are left out");
    axis.lower = -kInfinity, axis.upper = kInfinity;
  }
  if (axis.lower > axis.upper) {
    findings.repaired(element.child("limit")->source, where,
                      "the lower limit " + shown(axis.lower) + " is above the upper limit " +
                          shown(axis.upper) + "; they are taken the other way round");
    std::swap(axis.lower, axis.upper);
  }
  // Negative: no limit.
  const double effort = limit("limit/effort", kInfinity),
               velocity = limit("limit/velocity", kInfinity);
  axis.effort = effort < 0 ? kInfinity : effort;
  axis.velocity = velocity < 0 ? kInfinity : velocity;
}

void read_dynamics(const Element& element, const std::string& where, Findings& findings,
                   JointAxis& axis) {
  axis.damping = element.number("dynamics/damping", 0, Allowed::not_negative(quantity::kDamping));
  axis.friction = element.number("dynamics/friction", 0, Allowed::not_negative(quantity::kDamping));
  axis.spring_stiffness =
      element.number("dynamics/spring_stiffness", 0, Allowed::any(quantity::kDamping));
  if (axis.spring_stiffness < 0.0) {
    const Element& written = *element.child("dynamics/spring_stiffness");
    findings.error(written.source, where,
                   "<spring_stiffness>: '" + written.text +
                       "' is not allowed; allowed is a number of at least 0; there is no spring");
    axis.spring_stiffness = 0.0;
  }
  axis.spring_reference =
      element.number("dynamics/spring_reference", 0, Allowed::any(quantity::kAngle));
}

JointAxis read_axis(const Element& element, SdfVersion version, const Pose& X_MJ,
                    FrameGraph& frames, const Joint& joint, const std::string& where,
                    ReadContext& context) {
  report_other_children(element,
                        {"xyz", "limit", "dynamics", "use_parent_model_frame", "mimic",
                         "initial_position", "ruedo:position_gain", "ruedo:rate_gain"},
                        {}, where, context.findings);
  JointAxis axis;
  Vec3 xyz = element.vector3("xyz", Vec3::UnitZ(), Allowed::any(quantity::kFactor));
  if (!(xyz.norm() > 1e-9))
    element.child("xyz")->fail("'" + element.child("xyz")->text +
                               "' is not allowed; an axis is not zero");
  xyz.normalize();
  const Element* written = element.child("xyz");
  const std::string* frame = written ? written->attribute("expressed_in") : nullptr;
  // Before SDF 1.5, axes were given in the model's frame; 1.5 and 1.6 have a switch.
  const bool in_model =
      version < SdfVersion{1, 5} || element.boolean("use_parent_model_frame", false);
  if (frame && !frame->empty()) {
    xyz = X_MJ.rotation.conjugate() * (frames.pose(*frame, element).rotation * xyz);
  } else if (in_model) {
    xyz = X_MJ.rotation.conjugate() * xyz;
  }
  axis.axis_in_J = xyz;
  read_limits(element, joint, where, context.findings, axis);
  read_dynamics(element, where, context.findings, axis);
  axis.position_gain = element.number("ruedo:position_gain", axis.position_gain,
                                      Allowed::positive(quantity::kFactor));
  axis.rate_gain = element.number("ruedo:rate_gain", axis.rate_gain,
                                  Allowed::positive(quantity::kDamping).or_infinite());
  // With a servo it holds its position until its first command, as a real drive does.
  if (element.has("ruedo:position_gain") || element.has("ruedo:rate_gain"))
    axis.start.mode = JointStart::Mode::stay;
  return axis;
}

// Whether a joint's solver settings differ from the ones that Gazebo writes for every joint.
bool sets_anything(const Element& element) {
  if (element.children.empty() && !element.text.empty()) {
    for (const char* usual : {"0", "0.0", "1", "0.2", "true", "false"}) {
      if (element.text == usual) return false;
    }
    return element.text.find_first_of("123456789") != std::string::npos;
  }
  return std::any_of(element.children.begin(), element.children.end(),
                     [](const auto& child) { return sets_anything(*child); });
}

// m/rad; right-handed threads are positive. The older <thread_pitch> is in rad/m and counts
// left-handed threads.
double read_advance(const Element& joint) {
  if (joint.has("screw_thread_pitch"))
    return joint.number("screw_thread_pitch", 1.0, Allowed::any(quantity::kLength)) / (2.0 * M_PI);
  const double turns = joint.number("thread_pitch", 1.0, Allowed::any(quantity::kFactor));
  if (turns == 0.0)
    joint.child("thread_pitch")
        ->fail("'0' is not allowed; a thread that never advances is a continuous joint");
  return -1.0 / turns;
}

}  // namespace

void read_mimic(const Element& element, const IndexedVector<ModelJointIndex, Joint>& joints,
                Joint& joint) {
  const Element* mimic = element.child("axis/mimic");
  if (!mimic || joint.type == JointType::fixed || joint.type == JointType::ball) return;
  const std::string* written = mimic->attribute("joint");
  if (!written || written->empty())
    mimic->fail("needs the attribute joint, the name of the joint that it follows");
  if (const std::string* axis = mimic->attribute("axis"); axis && *axis != "axis")
    mimic->fail("axis '" + *axis + "' is not allowed; a joint follows the first axis of another");
  const std::string name = dotted(*written);
  const auto leader = std::find_if(joints.begin(), joints.end(),
                                   [&](const Joint& each) { return each.name == name; });
  if (leader == joints.end()) mimic->fail("joint '" + name + "' is not one of the model's joints");
  if (leader->type == JointType::fixed || leader->type == JointType::ball)
    mimic->fail("joint '" + name + "' has no position to follow");
  for (const Joint* each = &*leader;; each = &joints[each->leader]) {
    if (each == &joint)
      mimic->fail("joint '" + name + "' follows this one: a joint cannot follow itself");
    if (!each->leader.valid()) break;
  }
  joint.mimic_multiplier = mimic->number("multiplier", 1.0, Allowed::any(quantity::kFactor));
  joint.mimic_offset = mimic->number("offset", 0.0, Allowed::any(quantity::kAngle));
  joint.mimic_reference = mimic->number("reference", 0.0, Allowed::any(quantity::kAngle));
  joint.leader = ModelJointIndex(leader - joints.begin());
}

std::string beside_link(const std::string& joint) { return joint + " (joint)"; }

std::string joint_frame(FrameGraph& frames, const std::string& joint) {
  const std::string beside = beside_link(joint);
  return frames.has(beside) ? beside : joint;
}

std::string joint_end(const Element& joint, const char* which) {
  return joint.string(which, "").empty() ? joint.string(std::string(which) + "/link_name", "")
                                         : joint.string(which, "");
}

namespace {

JointType read_type(const Element& element, const std::string& where, Findings& findings) {
  const std::string* type = element.attribute("type");
  if (!type) element.fail("has no type");
  static const std::vector<std::pair<std::string, JointType>> kTypes = {
      {"fixed", JointType::fixed},
      {"revolute", JointType::revolute},
      {"continuous", JointType::continuous},
      {"prismatic", JointType::prismatic},
      {"ball", JointType::ball},
      {"universal", JointType::universal},
      {"revolute2", JointType::universal},
      {"screw", JointType::screw},
      {"gearbox", JointType::gearbox}};
  for (const auto& [name, value] : kTypes) {
    if (*type == name) return value;
  }
  if (*type != "planar" && *type != "floating") {
    std::vector<std::string> names;
    for (const auto& each : kTypes) names.push_back(each.first);
    const std::string near = nearest_word(*type, names);
    element.fail("type '" + *type +
                 "' is not allowed; allowed are fixed, revolute, continuous, prismatic, ball, "
                 "universal, screw, gearbox" +
                 (near.empty() ? "" : "; did you mean '" + near + "'?"));
  }
  findings.unsupported(element.source, where,
                       "joints of type '" + *type + "' are not supported; this one is held fixed");
  return Joint().type;
}

// <parent> or <child>, which must name something.
const Element& named_end(const Element& element, const char* which) {
  const Element* found = element.child(which);
  if (!found) element.fail(std::string("has no <") + which + ">");
  if (joint_end(element, which).empty()) found->fail("is empty; the name of a link is needed");
  return *found;
}

void read_ends(const Element& element, FrameGraph& frames,
               const IndexedVector<ModelLinkIndex, Link>& links, Joint& joint) {
  const Element &parent = named_end(element, "parent"), &child = named_end(element, "child");
  const std::string parent_name = joint_end(element, "parent"),
                    child_name = joint_end(element, "child");
  if (child_name == "world") child.fail("'world' is not allowed as the child of a joint");
  joint.parent = parent_name == "world" ? ModelLinkIndex() : frames.link(parent_name, parent);
  joint.child = frames.link(child_name, child);
  if (!joint.child.valid()) child.fail("'" + child_name + "' is not part of a link");
  if (!joint.parent.valid() && parent_name != "world")
    parent.fail("'" + parent_name + "' is not part of a link");
  if (joint.parent == joint.child)
    element.fail("joins the link '" + links[joint.child].name + "' to itself");
}

void read_axes(const Element& element, SdfVersion version, FrameGraph& frames,
               const std::string& where, ReadContext& context, Joint& joint) {
  const bool needs_axis = joint.type == JointType::revolute ||
                          joint.type == JointType::continuous ||
                          joint.type == JointType::prismatic || joint.type == JointType::screw ||
                          joint.type == JointType::gearbox;
  if (const Element* axis = element.child("axis")) {
    if (joint.type != JointType::fixed && joint.type != JointType::ball)
      joint.axis = read_axis(*axis, version, joint.X_MJ, frames, joint, where + "/axis", context);
  } else if (needs_axis) {
    element.fail("has no <axis>; joints of type '" + *element.attribute("type") + "' need one");
  }
  if (joint.type == JointType::screw) joint.advance = read_advance(element);
  if (joint.type != JointType::universal && joint.type != JointType::gearbox) return;
  if (joint.type == JointType::gearbox) joint.axis2 = joint.axis;
  if (const Element* axis2 = element.child("axis2"))
    joint.axis2 = read_axis(*axis2, version, joint.X_MJ, frames, joint, where + "/axis2", context);
  else if (joint.type == JointType::universal)
    joint.axis2.axis_in_J = Vec3::UnitX();
}

void read_gear(const Element& element, FrameGraph& frames, Joint& joint) {
  joint.gear_ratio = element.number("gearbox_ratio", 1.0, Allowed::any(quantity::kFactor));
  const Element* reference = element.child("gearbox_reference_body");
  if (!reference)
    element.fail(
        "has no <gearbox_reference_body>; joints of type 'gearbox' need the link that carries "
        "their gears, or 'world'");
  if (reference->text == "world") return;
  joint.gear_reference = frames.link(reference->text, *reference);
  if (!joint.gear_reference.valid())
    reference->fail("'" + reference->text + "' is not part of a link");
}

}  // namespace

Joint read_joint(const Element& element, SdfVersion version, FrameGraph& frames,
                 const IndexedVector<ModelLinkIndex, Link>& links, const std::string& where,
                 ReadContext& context) {
  report_other_children(element,
                        {"parent", "child", "pose", "axis", "axis2", "sensor", "thread_pitch",
                         "screw_thread_pitch", "gearbox_ratio", "gearbox_reference_body"},
                        {"physics"}, where, context.findings);
  if (const Element* solver = element.child("physics"); solver && sets_anything(*solver)) {
    context.findings.unsupported(
        solver->source, where,
        "<physics> of a joint is not supported: the solver's own settings hold");
  }
  Joint joint;
  joint.name = dotted(required_name(element));
  joint.source = element.source;
  joint.type = read_type(element, where, context.findings);
  read_ends(element, frames, links, joint);
  joint.X_MJ = frames.pose(joint_frame(frames, required_name(element)), element);
  read_axes(element, version, frames, where, context, joint);
  if (joint.type == JointType::gearbox) read_gear(element, frames, joint);
  return joint;
}

}  // namespace ruedo::world
