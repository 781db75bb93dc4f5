#include "world/sdf/saved_state.h"

#include <algorithm>

#include "world/drives/joint_start.h"
#include "world/read/read_context.h"

namespace ruedo::world {
namespace {

constexpr double kAside_m = 0.01;  // difference to the pose that the joints imply
constexpr double kExact = 1e-6;    // rad, m: rounding in states saved with few digits
constexpr double kMoving = 0.01;   // m/s, rad/s: slower things are at rest

std::vector<const Element*> states_of(const Element& parent, const std::string& what) {
  std::vector<const Element*> list = parent.all(what + "_state");
  const std::vector<const Element*> older = parent.all(what);
  list.insert(list.end(), older.begin(), older.end());
  return list;
}

// Elements that are ignored silently there change nothing: times, accelerations, wrenches. Those
// of the newer syntax are looked through by name_what_has_no_effect().
void name_unknown(const Element& element, Findings& findings, const std::string& where) {
  const std::string& of = element.name;
  const auto name = [&](const std::vector<std::string>& known,
                        const std::vector<std::string>& silent) {
    report_other_children(element, known, silent, where, findings);
  };
  if (of == "state")
    name({"model", "model_state", "light", "light_state"},
         {"joint", "joint_state", "insertions", "deletions", "sim_time", "wall_time", "real_time",
          "iterations"});
  else if (of == "model")
    name({"pose", "scale", "link", "link_state", "joint", "joint_state", "model", "model_state"},
         {"frame"});
  else if (of == "link")
    name({"pose", "velocity"}, {"acceleration", "wrench", "collision", "frame"});
  else if (of == "joint")
    name({"angle", "axis_state", "axis2_state"}, {});
  else if (of == "light")
    name({"pose"}, {"frame"});
}

// nullptr: it has none, which is reported.
const std::string* name_of(const Element& element, Findings& findings, const std::string& where) {
  const std::string* name = element.attribute("name");
  if (!name || name->empty())
    findings.error(element.source, where, "<" + element.name + "> has no name; it is left out");
  return name && !name->empty() ? name : nullptr;
}

// The position of its first axis; false: not given.
bool position_in(const Element& joint, double& position) {
  if (const Element* written = joint.child("axis_state/position")) {
    const std::string* degrees = written->attribute("degrees");
    position = written->as_number(Allowed::any(quantity::kAngle));
    if (degrees && (*degrees == "true" || *degrees == "1")) position *= M_PI / 180.0;
    return true;
  }
  for (const Element* angle : joint.all("angle")) {
    const std::string* axis = angle->attribute("axis");
    if (axis && *axis != "0") continue;
    position = angle->as_number(Allowed::any(quantity::kAngle));
    return true;
  }
  return false;
}

// A wheel starts at 0, however far it has turned.
bool is_of_drive(const Model& model, ModelJointIndex joint) {
  if (!model.drive) return false;
  const DriveDescription& drive = *model.drive;
  for (const auto* joints : {&drive.left_joints, &drive.right_joints, &drive.steer_joints}) {
    if (std::find(joints->begin(), joints->end(), joint) != joints->end()) return true;
  }
  return false;
}

// Everything starts at rest.
void name_motion(const Element& link, const std::string& where, Findings& findings) {
  const Element* velocity = link.child("velocity");
  if (!velocity) return;
  const std::vector<double> values = velocity->as_numbers(Allowed::any(quantity::kSpeed));
  if (std::all_of(values.begin(), values.end(), [](double v) { return std::abs(v) < kMoving; }))
    return;
  findings.unsupported(velocity->source, where,
                       "<velocity> is not supported: everything begins at rest");
}

void name_joint(const Element& joint, const std::string& where, Findings& findings) {
  for (const char* of : {"axis_state/velocity", "axis2_state/velocity", "axis2_state/position"}) {
    const Element* written = joint.child(of);
    if (written && std::abs(written->as_number(Allowed::any(quantity::kAngle))) > kMoving)
      findings.unsupported(
          written->source, where,
          std::string("<") + of + "> is not supported: joints begin at rest, second axes at 0");
  }
}

}  // namespace

SavedState::SavedState(const Element& world, Findings& findings) {
  for (const Element* state : world.all("state")) {
    name_unknown(*state, findings, "state");
    for (const Element* model : states_of(*state, "model")) read_model(*model, findings);
    for (const Element* light : states_of(*state, "light")) read_light(*light, findings);
    for (const Element* joint : states_of(*state, "joint")) {
      findings.unsupported(joint->source, "state",
                           "<" + joint->name +
                               "> outside of a model is not supported: joints between models begin "
                               "at 0");
    }
    for (const char* change : {"insertions", "deletions"}) {
      if (const Element* it = state->child(change))
        findings.unsupported(it->source, "state",
                             "<" + it->name + "> are not supported and left out");
    }
  }
}

void SavedState::read_light(const Element& element, Findings& findings) {
  const std::string* name = name_of(element, findings, "state");
  if (!name) return;
  const std::string where = "state/light " + *name;
  name_unknown(element, findings, where);
  if (lights_.contains(*name))
    findings.unsupported(element.source, where, "a second state of this light; this one counts");
  read_or_leave_out(where, "it is where it was", findings, [&] {
    SavedLight saved{std::nullopt, element.source};
    if (element.has("pose"))
      saved.pose = element.pose("pose");
    else
      findings.repaired(element.source, where, "it has no <pose>; the light is where it was");
    lights_.insert_or_assign(*name, saved);
  });
}

void SavedState::read_model(const Element& element, Findings& findings) {
  const std::string* name = name_of(element, findings, "state");
  if (!name) return;
  const std::string where = "state/model " + *name;
  if (models_.contains(*name))
    findings.unsupported(element.source, where, "a second state of this model; this one counts");
  // A simulation that diverged saves NaN; the models' own poses are used then.
  read_or_leave_out(where, "it is where its own pose says", findings, [&] {
    SavedModel saved{std::nullopt, element.source, {}, {}};
    if (element.has("pose"))
      saved.X_WM = element.pose("pose");
    else
      findings.repaired(element.source, where,
                        "it has no <pose>; the model is where its own pose says");
    read_parts(element, "", where, saved, findings);
    models_.insert_or_assign(*name, std::move(saved));
  });
}

void SavedState::read_parts(const Element& element, const std::string& prefix,
                            const std::string& where, SavedModel& saved, Findings& findings) const {
  name_unknown(element, findings, where);
  const Vec3 scale = element.vector3("scale", Vec3::Ones(), Allowed::any(quantity::kFactor));
  if ((scale - Vec3::Ones()).norm() > 1e-9)
    findings.unsupported(element.child("scale")->source, where,
                         "models are not scaled; it has its own size");
  const auto name_second = [&](const Element& part, bool is_first) {
    if (!is_first)
      findings.unsupported(part.source, where,
                           "a second state of '" + prefix + dotted(*part.attribute("name")) +
                               "' is left out; the first one counts");
  };
  for (const Element* link : states_of(element, "link")) {
    name_unknown(*link, findings, where);
    const std::string* own = name_of(*link, findings, where);
    if (own && link->has("pose"))
      name_second(*link, saved.links.try_emplace(prefix + dotted(*own), link->pose("pose")).second);
    name_motion(*link, where, findings);
  }
  for (const Element* joint : states_of(element, "joint")) {
    name_unknown(*joint, findings, where);
    const std::string* own = name_of(*joint, findings, where);
    double position = 0.0;
    if (own && position_in(*joint, position))
      name_second(*joint, saved.joints.try_emplace(prefix + dotted(*own), position).second);
    name_joint(*joint, where, findings);
  }
  for (const Element* inner : states_of(element, "model")) {
    if (const std::string* own = name_of(*inner, findings, where))
      read_parts(*inner, prefix + dotted(*own) + ".", where, saved, findings);
  }
}

void SavedState::apply(const std::string& name, ModelInstance& instance, Findings& findings) const {
  const auto found = models_.find(name);
  if (found == models_.end()) return;
  const SavedModel& saved = found->second;
  if (instance.model->path)
    return findings.unsupported(saved.source, "state/model " + name,
                                "the model begins where its own path does");
  if (saved.X_WM) instance.X_WM = *saved.X_WM;
  const Pose X_MW = instance.X_WM.inverse();
  const auto pose_of = [&](ModelLinkIndex link) -> const Pose* {
    if (!link.valid()) return nullptr;
    const auto at = saved.links.find(instance.model->links[link].name);
    return at == saved.links.end() ? nullptr : &at->second;
  };
  auto model = std::make_shared<Model>(*instance.model);
  IndexedVector<ModelJointIndex, double> starts(model->joints.size(), 0.0);
  for (const ModelJointIndex j : starts.indices()) {
    const Joint& joint = model->joints[j];
    if (is_of_drive(*model, j) || !has_position(joint)) continue;
    const Pose* child = pose_of(joint.child);
    const Pose* parent = pose_of(joint.parent);
    if (const auto at = saved.joints.find(joint.name); at != saved.joints.end())
      starts[j] = at->second;
    else if (child && (parent || !joint.parent.valid()))
      starts[j] = position_of(*model, joint, parent ? X_MW * *parent : Pose{}, X_MW * *child);
    if (std::abs(starts[j]) < kExact) starts[j] = 0.0;
  }
  begin_at(starts, "state/model " + name, *model, findings);
  instance.model = model;
  std::set<std::string_view> joints;
  for (const Joint& joint : model->joints) joints.insert(joint.name);
  for (const auto& [joint, position] : saved.joints) {
    if (!joints.contains(joint))
      findings.error(saved.source, "state/model " + name,
                     "the model has no joint '" + joint + "'; its position is left out");
  }
  std::map<std::string_view, const Link*> links;
  for (const Link& link : model->links) links.emplace(link.name, &link);
  for (const auto& [link, X_WL] : saved.links) {
    const auto own = links.find(link);
    if (own == links.end()) {
      findings.error(saved.source, "state/model " + name,
                     "the model has no link '" + link + "'; its pose is left out");
      continue;
    }
    const Vec3 aside = X_WL.translation - (instance.X_WM * own->second->X_ML).translation;
    if (aside.norm() < kAside_m) continue;
    findings.unsupported(saved.source, "state/model " + name,
                         "its link '" + link +
                             "' was elsewhere than any position of its joints puts it; it stands "
                             "where the model has it");
    break;
  }
}

void SavedState::apply(Light& light) const {
  if (const auto found = lights_.find(light.name); found != lights_.end())
    light.pose = found->second.pose.value_or(light.pose);
}

void SavedState::name_strangers(const std::set<std::string>& models,
                                const std::set<std::string>& lights, Findings& findings) const {
  const auto name_others = [&](const char* kind, const auto& saved, const auto& known) {
    for (const auto& [name, each] : saved) {
      if (!known.contains(name))
        findings.error(
            each.source, "state/" + std::string(kind) + " " + name,
            "the world has no " + std::string(kind) + " '" + name + "'; its state is left out");
    }
  };
  name_others("model", models_, models);
  name_others("light", lights_, lights);
}

}  // namespace ruedo::world
