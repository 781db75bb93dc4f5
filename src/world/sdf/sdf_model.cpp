// <model>: its frames, links and joints. Nested models are flattened into it.
#include <algorithm>
#include <set>

#include "world/compat/plugins.h"
#include "world/compat/sensor_plugins.h"
#include "world/compat/visual_plugins.h"
#include "world/document/reserved_names.h"
#include "world/drives/drive.h"
#include "world/drives/joint_start.h"
#include "world/sdf/sdf_link.h"
#include "world/sdf/sdf_reader.h"

namespace ruedo::world {
namespace {

constexpr size_t kMaxLinks = 20'000;  // per model: includes of includes cannot grow without end

struct Nested {
  std::shared_ptr<const ScopedModel> scope;
  std::string name, where;
  size_t first_link = 0;
  bool merged = false;
};

// The joint that fixes the links of a static nested model to the world.
Joint anchor(const std::string& name, ModelLinkIndex link, const Pose& X_MJ, const Source& source) {
  Joint joint;
  joint.name = name + ".anchor";
  joint.type = JointType::fixed;
  joint.child = link;
  joint.X_MJ = X_MJ;
  joint.source = source;
  return joint;
}

// Doors and lifts that share a joint's name get its scoped name.
void append_lifts(const Model& from, const std::string& prefix, int first_joint, Model& into) {
  const auto scoped = [&](const std::string& name) {
    const bool of_joint = std::any_of(from.doors.begin(), from.doors.end(), [&](const Door& door) {
      return door.name == name && door.leaves.front().joint_name == name;
    });
    return of_joint ? prefix + name : name;
  };
  for (Door door : from.doors) {
    door.name = scoped(door.name);
    for (Door::Leaf& leaf : door.leaves) {
      if (!leaf.joint.valid()) continue;
      leaf.joint += first_joint;
      leaf.joint_name = prefix + leaf.joint_name;
    }
    into.doors.push_back(std::move(door));
  }
  for (Lift lift : from.lifts) {
    lift.name = prefix + lift.name;
    lift.cabin += first_joint;
    for (Lift::Floor& floor : lift.floors) {
      for (std::string& door : floor.doors) door = scoped(door);
    }
    into.lifts.push_back(std::move(lift));
  }
}

// Merges a nested model: links, joints and sensors, with scoped names.
void append_nested(const Nested& nested, const Pose& X_MN, Model& into, Findings& findings) {
  const Model& from = *nested.scope->model;
  const std::string prefix = nested.merged ? "" : dotted(nested.name) + ".";
  const int first_link = static_cast<int>(nested.first_link), first_joint = into.joints.next();
  for (Link link : from.links) {
    link.name = prefix + link.name;
    link.X_ML = X_MN * link.X_ML;
    into.links.push_back(std::move(link));
  }
  for (Joint joint : from.joints) {
    joint.name = prefix + joint.name;
    joint.X_MJ = X_MN * joint.X_MJ;
    if (joint.parent.valid()) joint.parent += first_link;
    if (joint.gear_reference.valid()) joint.gear_reference += first_link;
    joint.child += first_link;
    if (joint.leader.valid()) joint.leader += first_joint;
    into.joints.push_back(std::move(joint));
  }
  for (SensorDescription sensor : from.sensors) {
    sensor.name = prefix + sensor.name;
    sensor.link += first_link;
    if (sensor.joint.valid()) sensor.joint += first_joint;
    into.sensors.push_back(std::move(sensor));
  }
  for (Hold hold : from.holds) {
    hold.link += first_link;
    if (hold.other_model.empty()) hold.other_link = prefix + hold.other_link;
    into.holds.push_back(std::move(hold));
  }
  append_lifts(from, prefix, first_joint, into);
  into.commanded |= from.commanded;
  if (from.drive && !into.drive) {
    into.drive = from.drive;
    for (ModelLinkIndex& belt : into.drive->belts) belt += first_link;
    for (auto* joints :
         {&into.drive->left_joints, &into.drive->right_joints, &into.drive->steer_joints}) {
      for (ModelJointIndex& joint : *joints) joint += first_joint;
    }
    into.drive->X_MBase = X_MN * into.drive->X_MBase;
  } else if (from.drive) {
    findings.unsupported(from.source, "model " + into.name,
                         "a second drive, of the nested model '" + from.name +
                             "', is not supported: its wheels turn freely");
  }
  if (from.path && !into.path && into.links.size() == from.links.size()) into.path = from.path;
}

// Makes `canonical` link 0, and renumbers all indices.
void bring_to_front(ModelLinkIndex canonical, ScopedModel& scope, Model& model) {
  if (canonical <= 0) return;
  std::rotate(model.links.begin(), model.links.begin() + canonical,
              model.links.begin() + canonical + 1);
  const auto moved = [&](ModelLinkIndex& link) {
    if (link == canonical)
      link = ModelLinkIndex(0);
    else if (link.valid() && link < canonical)
      ++link;
  };
  for (Joint& joint : model.joints)
    moved(joint.parent), moved(joint.child), moved(joint.gear_reference);
  for (SensorDescription& sensor : model.sensors) moved(sensor.link);
  for (Hold& hold : model.holds) moved(hold.link);
  for (auto& [name, frame] : scope.frames) moved(frame.link);
}

// A sensor in a joint is carried by the joint's child.
SensorDescription joint_sensor(const Element& element, const Joint& joint, const Pose& X_MS,
                               const Model& model) {
  const Pose& X_ML = model.links[joint.child].X_ML;
  SensorDescription sensor = read_sensor(element, joint.child, X_ML.inverse() * X_MS);
  sensor.joint = ModelJointIndex(&joint - model.joints.data());
  return sensor;
}

// Unless it names another frame, its <pose> is relative to the joint.
void read_joint_sensor(const Element& element, FrameGraph& frames, Model& model) {
  const Joint& joint = model.joints.back();
  const std::string frame = relative_to(element);
  const Pose X_MF = frame.empty() ? joint.X_MJ : frames.pose(frame, element);
  model.sensors.push_back(joint_sensor(element, joint, X_MF * element.pose("pose"), model));
}

}  // namespace

// Reads one <model>: the names of all its parts first, then their poses, since frames may be
// declared in any order.
class SdfReader::ModelReader {
 public:
  ModelReader(SdfReader& reader, const Element& element, SdfVersion version)
      : reader_(reader),
        findings_(reader.context_.findings),
        element_(element),
        version_(version),
        where_("model " + name_of_model(element)),
        frames_(where_) {}

  // nullptr: it has no link, which is reported.
  std::shared_ptr<const ScopedModel> read();

 private:
  void read_attributes();
  // Names and frames.
  void read_parts();
  void read_part(const Element& child);
  FrameGraph::Node framed(const Element& child) const;
  FrameGraph::Node link_node(const Element& child);
  FrameGraph::Node attached_node(const Element& child, const std::string& attached_to) const;
  std::optional<FrameGraph::Node> nested_node(const Element& child);
  std::optional<Nested> nested_part(const Element& child);
  // Links and joints, where the frames are.
  void append_links();
  void append_link(const Element& child);
  void append_part(const Nested& part, const Element& child);
  void read_joints();
  void read_joint_and_sensors(const Element& child);
  void read_initial_values(const Element& system);
  void read_initial_position(const Element& child, const std::string& where);
  bool lacks_an_end(const Element& joint);
  void read_plugin_sensors();
  void read_mimic_plugin(const Element& plugin);
  void read_mimic_params(const Element& system);
  // Findings about the model as a whole.
  void export_frames();
  ModelLinkIndex canonical_link();
  void read_path();

  SdfReader& reader_;
  Findings& findings_;
  const Element& element_;
  SdfVersion version_;
  std::string where_;
  FrameGraph frames_;
  std::shared_ptr<ScopedModel> scope_ = std::make_shared<ScopedModel>();
  std::shared_ptr<Model> model_ = std::make_shared<Model>();
  std::vector<Nested> nested_;
  size_t link_count_ = 0;
  ModelLinkIndex first_own_link_;
  JointPositions starts_;  // <initial_position> of each joint
  bool parts_missing_ = false;
  bool all_static_ = true;             // whether all its parts are static
  std::set<const Element*> left_out_;  // children that are left out
  std::set<std::string> joint_names_;
  std::vector<Joint> anchors_;
};

std::shared_ptr<const ScopedModel> SdfReader::read_model(const Element& element,
                                                         SdfVersion version) {
  return ModelReader(*this, element, version).read();
}

std::shared_ptr<const ScopedModel> SdfReader::ModelReader::read() {
  read_attributes();
  read_parts();
  if (link_count_ == 0) {
    findings_.error(element_.source, where_, "it has no link; the model is left out");
    return nullptr;
  }
  append_links();
  if (all_static_) model_->is_static = true;
  read_joints();
  if (!model_->is_static)
    model_->joints.insert(model_->joints.end(), anchors_.begin(), anchors_.end());
  read_plugin_sensors();
  read_labels_and_temperatures(element_, where_, findings_, *model_);
  export_frames();
  bring_to_front(canonical_link(), *scope_, *model_);
  make_sensor_names_unique(*model_, where_, findings_);
  read_drive_of(element_, where_, reader_.context_, *model_);
  model_->commanded |= element_.has("ruedo:joints");
  model_->commanded &=
      !model_->is_static &&
      (!model_->holds.empty() ||
       std::any_of(model_->joints.begin(), model_->joints.end(),
                   [](const Joint& joint) { return joint.type != JointType::fixed; }));
  read_path();
  begin_at(starts_, where_, *model_, findings_);
  scope_->model = std::move(model_);
  return scope_;
}

void SdfReader::ModelReader::read_attributes() {
  model_->name = name_of_model(element_);
  if (*element_.attribute("name") == "world")
    findings_.repaired(element_.source, where_,
                       "'world' is a reserved name; the model is called '" + model_->name + "'");
  report_other_children(
      element_,
      {"link", "joint", "frame", "model", "include", "pose", "static", "self_collide", "plugin",
       "ruedo:drive", "ruedo:joints", "ruedo:odometry", "ruedo:path", "ruedo:belt", "ruedo:door",
       "transmission", "ros2_control", "enable_wind", "allow_auto_disable"},
      {}, where_, findings_);
  model_->source = element_.source;
  model_->is_static = element_.boolean("static", false);
  model_->self_collide = element_.boolean("self_collide", false);
  scope_->pose = element_.pose("pose");
  scope_->relative_to = relative_to(element_);
  if (const std::string* frame = element_.attribute("placement_frame"))
    scope_->placement_frame = *frame;
}

void SdfReader::ModelReader::read_parts() {
  // frames last: of two things with one name, the frame is dropped
  std::vector<const Element*> in_order;
  const auto rank = [](const Element& child) {
    return child.name == "frame" ? 2 : child.name == "joint" ? 1 : 0;
  };
  for (const int each : {0, 1, 2}) {
    for (const auto& child : element_.children) {
      if (rank(*child) == each) in_order.push_back(child.get());
    }
  }
  for (const Element* child : in_order) {
    const size_t open_files = reader_.files_.size(), links_before = link_count_,
                 nested_before = nested_.size();
    const std::string what =
        child->name == "include" || child->name == "model" ? "part" : child->name;
    if (read_or_leave_out(where_, "the " + what + " is left out", findings_,
                          [&] { read_part(*child); }))
      continue;
    reader_.files_.resize(open_files);
    link_count_ = links_before;
    nested_.resize(nested_before);
    left_out_.insert(child);
    parts_missing_ |= what != "frame";
  }
}

void SdfReader::ModelReader::read_part(const Element& child) {
  std::optional<FrameGraph::Node> node;
  if (child.name == "link") {
    node = link_node(child);
  } else if (child.name == "joint") {
    node = attached_node(child, joint_end(child, "child"));
    if (joint_names_.insert(node->name).second && frames_.has(node->name)) {
      findings_.repaired(child.source, where_,
                         "the joint '" + node->name +
                             "' has the name of a link; as a frame the name is the link's");
      node->name = beside_link(node->name);
    }
  } else if (child.name == "frame") {
    const std::string* frame = child.attribute("attached_to");
    node = attached_node(child, frame ? *frame : "");
    // A frame may not share its name with anything else: it is dropped and reported. For other
    // duplicates the model is refused.
    if (frames_.has(node->name)) child.fail("the name '" + node->name + "' is taken in " + where_);
  } else if (child.name == "model" || child.name == "include") {
    node = nested_node(child);
  }
  if (!node) return;
  frames_.add(std::move(*node));
  if (link_count_ > kMaxLinks)
    throw TooLarge(child.source, "<" + child.name + ">: the model has more than " +
                                     std::to_string(kMaxLinks) + " links");
}

// The node of a part, with name and pose from its element.
FrameGraph::Node SdfReader::ModelReader::framed(const Element& child) const {
  FrameGraph::Node node;
  node.element = &child;
  node.name = required_name(child);
  node.pose = child.pose("pose");
  node.relative_to = relative_to(child);
  return node;
}

FrameGraph::Node SdfReader::ModelReader::link_node(const Element& child) {
  FrameGraph::Node node = framed(child);
  if (frames_.has(node.name)) frames_.add(std::move(node));  // throws
  node.link = ModelLinkIndex(link_count_++);
  if (!first_own_link_.valid()) first_own_link_ = node.link;
  return node;
}

FrameGraph::Node SdfReader::ModelReader::attached_node(const Element& child,
                                                       const std::string& attached_to) const {
  FrameGraph::Node node = framed(child);
  node.attached_to = attached_to;
  if (node.relative_to.empty()) node.relative_to = attached_to;
  return node;
}

// nullopt: the part is missing, which has been reported.
std::optional<FrameGraph::Node> SdfReader::ModelReader::nested_node(const Element& child) {
  std::optional<Nested> part = nested_part(child);
  if (!part) {
    parts_missing_ = true;
    return std::nullopt;
  }
  FrameGraph::Node node;
  node.element = &child;
  node.name = part->merged ? "__merged " + std::to_string(nested_.size()) + "__" : part->name;
  node.pose = part->scope->pose;
  node.relative_to = part->scope->relative_to;
  node.placement_frame = part->scope->placement_frame;
  node.scope = part->scope;
  node.first_link = ModelLinkIndex(link_count_);
  node.merged = part->merged;
  part->name = node.name;
  part->first_link = link_count_;
  link_count_ += part->scope->model->links.size();
  nested_.push_back(std::move(*part));
  return node;
}

std::optional<Nested> SdfReader::ModelReader::nested_part(const Element& child) {
  Nested part;
  part.where = where_;
  if (child.name == "model") {
    part.scope = reader_.read_model(child, version_);
    part.name = required_name(child);
    part.merged = child.attribute("merge") != nullptr;  // merged because of a joint of the world
  } else {
    auto included = reader_.include(child, where_ + "/include");
    if (included && !included->model) child.fail("is not a model; a model can include models only");
    if (included) part.scope = included->model, part.name = included->name;
    const std::string* merge = child.attribute("merge");
    part.merged = merge && (*merge == "true" || *merge == "1");
  }
  if (!part.scope) return std::nullopt;
  return part;
}

// Links and nested models in file order, the order in which indices were assigned.
void SdfReader::ModelReader::append_links() {
  size_t next_nested = 0;
  for (const auto& child : element_.children) {
    if (left_out_.count(child.get())) continue;
    if (child->name == "link") {
      append_link(*child);
    } else if (next_nested < nested_.size() &&
               (child->name == "model" || child->name == "include") &&
               model_->links.size() == nested_[next_nested].first_link) {
      const Nested& part = nested_[next_nested];
      // A missing part left no entry: it is recognised by the element of the entry.
      if (!frames_.is_from(part.name, *child)) continue;
      ++next_nested;
      append_part(part, *child);
    }
  }
}

void SdfReader::ModelReader::append_link(const Element& child) {
  all_static_ = false;
  const Pose X_ML = frames_.pose(required_name(child), child);
  const auto in_link = [&](const Element& owner) {
    const std::string frame = relative_to(owner);
    const Pose pose = owner.pose("pose");
    return frame.empty() ? pose : X_ML.inverse() * (frames_.pose(frame, owner) * pose);
  };
  const ModelLinkIndex index = model_->links.next();
  Link link = read_link(child, in_link, where_ + "/link " + required_name(child), reader_.context_,
                        !model_->is_static, index, model_->sensors);
  link.name = dotted(link.name);
  link.X_ML = X_ML;
  if (!child.has("enable_wind")) link.wind = element_.boolean("enable_wind", false);
  link.sleeps = element_.boolean("allow_auto_disable", true);
  model_->links.push_back(std::move(link));
}

void SdfReader::ModelReader::append_part(const Nested& part, const Element& child) {
  append_nested(part, frames_.pose(part.name, child), *model_, findings_);
  if (!part.scope->model->is_static) {
    all_static_ = false;
    return;
  }
  for (size_t i = part.first_link; i < part.first_link + part.scope->model->links.size(); ++i)
    anchors_.push_back(
        anchor(model_->links[i].name, ModelLinkIndex(i), model_->links[i].X_ML, child.source));
}

// The pose and link of every name, for files that nest or place this model.
void SdfReader::ModelReader::export_frames() {
  for (const std::string& name : frames_.names()) {
    read_or_leave_out(where_, "the frame '" + name + "' is left out", findings_, [&] {
      scope_->frames[name] = {frames_.pose(name, element_), frames_.link(name, element_)};
    });
  }
}

ModelLinkIndex SdfReader::ModelReader::canonical_link() {
  ModelLinkIndex canonical(std::max<int>(first_own_link_, 0));
  if (const std::string* name = element_.attribute("canonical_link"); name && !name->empty()) {
    read_or_leave_out(where_, "its first link is taken", findings_, [&] {
      const ModelLinkIndex link = frames_.link(*name, element_);
      if (!link.valid()) element_.fail("canonical_link '" + *name + "' is not a link");
      canonical = link;
    });
  }
  return canonical;
}

void SdfReader::ModelReader::read_path() {
  for (const char* name : {"ruedo:path", "ruedo:belt", "ruedo:door"}) {
    const Element* path = element_.child(name);
    if (!path) continue;
    if (model_->path) path->fail("a model has one of <ruedo:path>, <ruedo:belt> and <ruedo:door>");
    if (path->name == "ruedo:path") path->refuse_unknown({"ruedo:waypoint", "ruedo:loop"}, false);
    model_->path = path->clone();
    model_->is_static = false;
  }
  if (!model_->path) return;
  for (Link& link : model_->links) link.kinematic = true;
}

void SdfReader::ModelReader::read_plugin_sensors() {
  for (const Element* plugin : element_.all("plugin")) {
    read_or_leave_out(where_, "the sensor is left out", findings_, [&] {
      const PluginSensor made = sensor_from_plugin(*plugin, where_, reader_.performers_, findings_);
      if (!made.sensor) return;
      const Pose pose = made.sensor->pose("pose");
      if (made.joint.empty()) {
        const ModelLinkIndex link =
            made.link.empty() ? ModelLinkIndex(0) : frames_.link(made.link, *plugin);
        if (!link.valid()) plugin->fail("'" + made.link + "' is not a link");
        model_->sensors.push_back(read_sensor(*made.sensor, link, pose));
        return;
      }
      const auto joint =
          std::find_if(model_->joints.begin(), model_->joints.end(),
                       [&](const Joint& each) { return each.name == dotted(made.joint); });
      if (joint == model_->joints.end()) plugin->fail("'" + made.joint + "' is not a joint");
      model_->sensors.push_back(joint_sensor(*made.sensor, *joint, joint->X_MJ * pose, *model_));
    });
  }
}

void SdfReader::ModelReader::read_joints() {
  for (const auto& child : element_.children) {
    if (child->name == "joint" && !left_out_.count(child.get())) read_joint_and_sensors(*child);
  }
  for (const auto& child : element_.children) {
    if (child->name != "joint") continue;
    const std::string name = dotted(required_name(*child));
    const auto joint = std::find_if(model_->joints.begin(), model_->joints.end(),
                                    [&](const Joint& each) { return each.name == name; });
    if (joint == model_->joints.end()) continue;
    read_or_leave_out(where_ + "/joint " + name, "the joint moves on its own", findings_,
                      [&] { read_mimic(*child, model_->joints, *joint); });
  }
  starts_.resize(model_->joints.size(), 0.0);
  for (const Element* system : element_.all("ros2_control")) read_mimic_params(*system);
  for (const Element* system : element_.all("ros2_control"))
    read_or_leave_out(where_, "its joints begin at 0", findings_,
                      [&] { read_initial_values(*system); });
  for (const Element* plugin : element_.all("plugin")) {
    if (kind_of(*plugin).name.find("mimic_joint_plugin") != std::string::npos)
      read_or_leave_out(where_, "the joint moves on its own", findings_,
                        [&] { read_mimic_plugin(*plugin); });
  }
}

// For Gazebo Classic, whose joints had no <mimic>.
void SdfReader::ModelReader::read_mimic_plugin(const Element& plugin) {
  const auto named = [&](const char* what) -> Joint& {
    const std::string name = dotted(plugin.string(what, ""));
    const auto found = std::find_if(model_->joints.begin(), model_->joints.end(),
                                    [&](const Joint& each) { return each.name == name; });
    if (found == model_->joints.end())
      plugin.fail(std::string("<") + what + ">: '" + name + "' is not one of the model's joints");
    return *found;
  };
  const Joint& leader = named("joint");
  Joint& follower = named("mimicJoint");
  if (&leader == &follower || leader.leader.valid())
    plugin.fail("a joint cannot follow itself, or one that follows");
  follower.leader = ModelJointIndex(&leader - model_->joints.data());
  follower.mimic_multiplier = plugin.number("multiplier", 1.0, Allowed::any(quantity::kFactor));
  follower.mimic_offset = plugin.number("offset", 0.0, Allowed::any(quantity::kAngle));
}

// <ros2_control>: <param name="mimic"> of a joint, with a multiplier and an offset. As in
// gz_ros2_control, a <mimic> of the joint's own comes first.
void SdfReader::ModelReader::read_mimic_params(const Element& system) {
  for (const Element* control : system.all("joint")) {
    const auto param = [&](const std::string& name) -> const Element* {
      for (const Element* each : control->all("param")) {
        if (const std::string* key = each->attribute("name"); key && *key == name) return each;
      }
      return nullptr;
    };
    const Element* leader = param("mimic");
    const std::string* name = control->attribute("name");
    const auto joint =
        std::find_if(model_->joints.begin(), model_->joints.end(),
                     [&](const Joint& each) { return name && each.name == dotted(*name); });
    if (!leader || joint == model_->joints.end()) continue;
    const std::string where = where_ + "/joint " + *name;
    if (joint->leader.valid()) {
      if (model_->joints[joint->leader].name != dotted(leader->text))
        findings_.unsupported(leader->source, where,
                              "its param mimic is left out: by its <mimic> it follows '" +
                                  model_->joints[joint->leader].name + "'");
      continue;
    }
    Element follows;
    Element& axis = *follows.children.emplace_back(std::make_unique<Element>());
    axis.name = "axis";
    Element& mimic = *axis.children.emplace_back(std::make_unique<Element>());
    mimic.name = "mimic";
    mimic.source = leader->source;
    mimic.attributes.emplace_back("joint", leader->text);
    for (const char* number : {"multiplier", "offset"}) {
      if (const Element* written = param(number)) {
        mimic.children.push_back(written->clone());
        mimic.children.back()->name = number;
      }
    }
    read_or_leave_out(where, "the joint moves on its own", findings_,
                      [&] { read_mimic(follows, model_->joints, *joint); });
  }
}

void SdfReader::ModelReader::read_joint_and_sensors(const Element& child) {
  const std::string name = required_name(child), here = where_ + "/joint " + name;
  if (parts_missing_ && lacks_an_end(child)) {
    findings_.error(child.source, here,
                    "it joins a link of a part that was not found; the joint is left out");
    frames_.drop(joint_frame(frames_, name));
    return;
  }
  const bool read = read_or_leave_out(here, "the joint is left out", findings_, [&] {
    model_->joints.push_back(
        read_joint(child, version_, frames_, model_->links, here, reader_.context_));
  });
  if (!read) {
    frames_.drop(joint_frame(frames_, name));
    return;
  }
  read_initial_position(child, here);
  for (const Element* sensor : child.all("sensor")) {
    read_or_leave_out(here, "the sensor is left out", findings_,
                      [&] { read_joint_sensor(*sensor, frames_, *model_); });
  }
}

void SdfReader::ModelReader::read_initial_position(const Element& child, const std::string& where) {
  starts_.resize(model_->joints.size(), 0.0);
  read_or_leave_out(where, "it begins at 0", findings_, [&] {
    const double start =
        child.number("axis/initial_position", 0.0, Allowed::any(quantity::kLength));
    if (start == 0.0 || has_position(model_->joints.back()))
      starts_.back() = start;
    else
      findings_.unsupported(child.child("axis/initial_position")->source, where,
                            "<initial_position> is not supported in such a joint: it begins at 0");
  });
}

// <ros2_control>: the position at which gz_ros2_control starts a joint.
void SdfReader::ModelReader::read_initial_values(const Element& system) {
  for (const Element* joint : system.all("joint")) {
    const std::string* name = joint->attribute("name");
    const auto own =
        std::find_if(model_->joints.begin(), model_->joints.end(),
                     [&](const Joint& each) { return name && each.name == dotted(*name); });
    if (own == model_->joints.end() || !has_position(*own)) continue;
    for (const Element* state : joint->all("state_interface")) {
      const std::string* what = state->attribute("name");
      if (!what || *what != "position") continue;
      for (const Element* param : state->all("param")) {
        const std::string* key = param->attribute("name");
        if (!key || *key != "initial_value") continue;
        double& start = starts_[ModelJointIndex(own - model_->joints.begin())];
        const double value = param->as_number(Allowed::any(quantity::kLength));
        if (start != 0.0 && start != value)
          findings_.unsupported(param->source, where_ + "/joint " + *name,
                                "a second initial_value of its position; this one counts");
        start = value;
      }
    }
  }
}

// Missing parts may have contained its links.
bool SdfReader::ModelReader::lacks_an_end(const Element& joint) {
  const std::string parent = joint_end(joint, "parent");
  return (parent != "world" && !frames_.has(parent)) || !frames_.has(joint_end(joint, "child"));
}

}  // namespace ruedo::world
