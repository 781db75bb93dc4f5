#include "model/saved_state.h"

#include <algorithm>

#include "model/joint_start.h"
#include "model/read_context.h"

namespace ruedo::model {
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
    for (const Element* model : states_of(*state, "model")) read_model(*model, findings);
    for (const Element* light : states_of(*state, "light")) {
      const std::string* name = light->attribute("name");
      if (!name || !light->has("pose")) continue;
      read_or_leave_out("state/light " + *name, "it is where it was", findings, [&] {
        lights_.insert_or_assign(*name, SavedLight{light->pose("pose"), light->source});
      });
    }
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

void SavedState::read_model(const Element& element, Findings& findings) {
  const std::string* name = element.attribute("name");
  if (!name) return;
  // A simulation that diverged saves NaN; the models' own poses are used then.
  read_or_leave_out("state/model " + *name, "it is where its own pose says", findings, [&] {
    SavedModel saved{element.pose("pose"), element.source, {}, {}};
    read_parts(element, "", saved, findings);
    if (element.has("pose")) models_.insert_or_assign(*name, std::move(saved));
  });
}

void SavedState::read_parts(const Element& element, const std::string& prefix, SavedModel& saved,
                            Findings& findings) const {
  const std::string where = "state/model " + *element.attribute("name");
  const Vec3 scale = element.vector3("scale", Vec3::Ones(), Allowed::any(quantity::kFactor));
  if ((scale - Vec3::Ones()).norm() > 1e-9)
    findings.unsupported(element.child("scale")->source, where,
                         "models are not scaled; it has its own size");
  for (const Element* link : states_of(element, "link")) {
    const std::string* own = link->attribute("name");
    if (own && link->has("pose"))
      saved.links.try_emplace(prefix + dotted(*own), link->pose("pose"));
    name_motion(*link, where, findings);
  }
  for (const Element* joint : states_of(element, "joint")) {
    const std::string* own = joint->attribute("name");
    double position = 0.0;
    if (own && position_in(*joint, position)) saved.joints[prefix + dotted(*own)] = position;
    name_joint(*joint, where, findings);
  }
  for (const Element* inner : states_of(element, "model")) {
    if (const std::string* own = inner->attribute("name"))
      read_parts(*inner, prefix + dotted(*own) + ".", saved, findings);
  }
}

void SavedState::apply(const std::string& name, ModelInstance& instance, Findings& findings) const {
  const auto found = models_.find(name);
  if (found == models_.end() || instance.model->path) return;
  const SavedModel& saved = found->second;
  instance.X_WM = saved.X_WM;
  const Pose X_MW = saved.X_WM.inverse();
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
    light.pose = found->second.pose;
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

}  // namespace ruedo::model
