// <model>: its frames, links and joints; nested models flattened into it.
#include <algorithm>
#include <set>

#include "model/drive.h"
#include "model/sdf_link.h"
#include "model/sdf_reader.h"
#include "model/sensor_plugins.h"
#include "model/visual_plugins.h"

namespace ruedo::model {
namespace {

constexpr size_t kMaxLinks = 20'000;  // of one model: includes of includes cannot grow without end

struct Nested {
  std::shared_ptr<const ScopedModel> scope;
  std::string name, where;
  size_t first_link = 0;
  bool merged = false;
};

// A joint that keeps what a static nested model brings from moving with the rest.
Joint anchor(const std::string& name, int link, const Pose& X_MJ, const Source& source) {
  Joint joint;
  joint.name = name + ".anchor";
  joint.type = JointType::fixed;
  joint.parent = -1;
  joint.child = link;
  joint.X_MJ = X_MJ;
  joint.source = source;
  return joint;
}

// Takes over a nested model: links, joints and sensors with the scoped name.
void append_nested(const Nested& nested, const Pose& X_MN, Model& into, Findings& findings) {
  const Model& from = *nested.scope->model;
  const std::string prefix = nested.merged ? "" : dotted(nested.name) + ".";
  const int first_link = static_cast<int>(nested.first_link),
            first_joint = static_cast<int>(into.joints.size());
  for (Link link : from.links) {
    link.name = prefix + link.name;
    link.X_ML = X_MN * link.X_ML;
    into.links.push_back(std::move(link));
  }
  for (Joint joint : from.joints) {
    joint.name = prefix + joint.name;
    joint.X_MJ = X_MN * joint.X_MJ;
    if (joint.parent >= 0) joint.parent += first_link;
    joint.child += first_link;
    if (joint.leader >= 0) joint.leader += first_joint;
    into.joints.push_back(std::move(joint));
  }
  for (SensorDescription sensor : from.sensors) {
    sensor.name = prefix + sensor.name;
    sensor.link += first_link;
    if (sensor.joint >= 0) sensor.joint += first_joint;
    into.sensors.push_back(std::move(sensor));
  }
  into.commanded |= from.commanded;
  if (from.drive && !into.drive) {
    into.drive = from.drive;
    for (auto* joints :
         {&into.drive->left_joints, &into.drive->right_joints, &into.drive->steer_joints}) {
      for (int& joint : *joints) joint += first_joint;
    }
    into.drive->X_MBase = X_MN * into.drive->X_MBase;
  } else if (from.drive) {
    findings.unsupported(from.source, "model " + into.name,
                         "a second drive, of the nested model '" + from.name +
                             "', is not supported: its wheels turn freely");
  }
  if (from.path && !into.path && into.links.size() == from.links.size()) into.path = from.path;
}

// Makes `canonical` link 0; every index follows.
void bring_to_front(int canonical, ScopedModel& scope, Model& model) {
  if (canonical <= 0) return;
  std::rotate(model.links.begin(), model.links.begin() + canonical,
              model.links.begin() + canonical + 1);
  const auto moved = [&](int& link) {
    if (link == canonical)
      link = 0;
    else if (link >= 0 && link < canonical)
      ++link;
  };
  for (Joint& joint : model.joints) moved(joint.parent), moved(joint.child);
  for (SensorDescription& sensor : model.sensors) moved(sensor.link);
  for (auto& [name, frame] : scope.frames) moved(frame.link);
}

// A sensor of a joint sits on the joint's child.
SensorDescription joint_sensor(const Element& element, const Joint& joint, const Pose& X_MS,
                               const Model& model) {
  const Pose& X_ML = model.links[static_cast<size_t>(joint.child)].X_ML;
  SensorDescription sensor = read_sensor(element, joint.child, X_ML.inverse() * X_MS);
  sensor.joint = static_cast<int>(&joint - model.joints.data());
  return sensor;
}

// Without a frame of its own its <pose> is in the joint's.
void read_joint_sensor(const Element& element, FrameGraph& frames, Model& model) {
  const Joint& joint = model.joints.back();
  const std::string frame = relative_to(element);
  const Pose X_MF = frame.empty() ? joint.X_MJ : frames.pose(frame, element);
  model.sensors.push_back(joint_sensor(element, joint, X_MF * element.pose("pose"), model));
}

}  // namespace

std::shared_ptr<const ScopedModel> SdfReader::read_model(const Element& element,
                                                         SdfVersion version) {
  auto scope = std::make_shared<ScopedModel>();
  auto model = std::make_shared<Model>();
  model->name = required_name(element);
  const std::string where = "model " + model->name;
  report_other_children(element,
                        {"link", "joint", "frame", "model", "include", "pose", "static",
                         "self_collide", "plugin", "ruedo:drive", "ruedo:joints", "ruedo:odometry",
                         "ruedo:path", "ruedo:belt", "ruedo:door", "transmission", "ros2_control"},
                        {"allow_auto_disable", "enable_wind"}, where, context_.findings);
  model->source = element.source;
  model->is_static = element.boolean("static", false);
  model->self_collide = element.boolean("self_collide", false);
  scope->pose = element.pose("pose");
  scope->relative_to = relative_to(element);
  if (const std::string* frame = element.attribute("placement_frame"))
    scope->placement_frame = *frame;

  // First all names, then poses: frames may be written in any order.
  FrameGraph frames(where);
  std::vector<const Element*> links;
  std::vector<Nested> nested;
  size_t link_count = 0;
  int first_own_link = -1;
  bool parts_missing = false;
  std::set<const Element*> left_out;
  const auto read_part = [&](const Element* child) {
    FrameGraph::Node node;
    node.element = child;
    // A frame may be named like something else; everything else may not.
    const auto is_taken = [&] { return child->name == "frame" && frames.has(node.name); };
    if (child->name == "link") {
      node.name = required_name(*child);
      if (frames.has(node.name)) frames.add(std::move(node));  // throws
      node.pose = child->pose("pose");
      node.relative_to = relative_to(*child);
      node.link = static_cast<int>(link_count++);
      if (first_own_link < 0) first_own_link = node.link;
    } else if (child->name == "joint") {
      node.name = required_name(*child);
      node.pose = child->pose("pose");
      node.relative_to = relative_to(*child);
      node.attached_to = joint_end(*child, "child");
      if (node.relative_to.empty()) node.relative_to = node.attached_to;
    } else if (child->name == "frame") {
      node.name = required_name(*child);
      node.pose = child->pose("pose");
      node.relative_to = relative_to(*child);
      if (const std::string* frame = child->attribute("attached_to")) node.attached_to = *frame;
      if (node.relative_to.empty()) node.relative_to = node.attached_to;
    } else if (child->name == "model" || child->name == "include") {
      Nested part;
      part.where = where;
      if (child->name == "model") {
        part.scope = read_model(*child, version);
        part.name = required_name(*child);
      } else {
        auto included = include(*child, where + "/include");
        if (included && !included->model)
          child->fail("is no model; a model can include models only");
        if (included) part.scope = included->model, part.name = included->name;
        const std::string* merge = child->attribute("merge");
        part.merged = merge && (*merge == "true" || *merge == "1");
      }
      if (!part.scope) {
        parts_missing = true;
        return;
      }
      part.first_link = link_count;
      node.name = part.merged ? "__merged " + std::to_string(nested.size()) + "__" : part.name;
      node.pose = part.scope->pose;
      node.relative_to = part.scope->relative_to;
      node.placement_frame = part.scope->placement_frame;
      node.scope = part.scope;
      node.first_link = static_cast<int>(link_count);
      node.merged = part.merged;
      part.name = node.name;
      link_count += part.scope->model->links.size();
      nested.push_back(std::move(part));
    } else {
      return;
    }
    if (is_taken()) child->fail("the name '" + node.name + "' is taken in " + where);
    frames.add(std::move(node));
    if (link_count > kMaxLinks)
      throw TooLarge(child->source, "<" + child->name + ">: the model has more than " +
                                        std::to_string(kMaxLinks) + " links");
  };
  std::vector<const Element*> in_order;  // frames last: of two of one name the frame goes
  for (const bool is_frame : {false, true}) {
    for (const auto& child : element.children) {
      if ((child->name == "frame") == is_frame) in_order.push_back(child.get());
    }
  }
  for (const Element* child : in_order) {
    const size_t open_files = files_.size(), links_before = link_count,
                 nested_before = nested.size();
    const std::string what =
        child->name == "include" || child->name == "model" ? "part" : child->name;
    if (read_or_leave_out(where, "the " + what + " is left out", context_.findings,
                          [&] { read_part(child); }))
      continue;
    files_.resize(open_files);
    link_count = links_before;
    nested.resize(nested_before);
    left_out.insert(child);
    parts_missing |= what != "frame";
  }
  if (link_count == 0) {
    context_.findings.error(element.source, where, "it has no link; the model is left out");
    return nullptr;
  }

  // Links and nested models in the file's order, as the indices were given.
  std::vector<Joint> anchors;
  size_t next_nested = 0;
  bool all_static = true;
  for (const auto& child : element.children) {
    if (left_out.count(child.get())) continue;
    if (child->name == "link") {
      all_static = false;
      const Pose X_ML = frames.pose(required_name(*child), *child);
      const auto in_link = [&](const Element& owner) {
        const std::string frame = relative_to(owner);
        const Pose pose = owner.pose("pose");
        return frame.empty() ? pose : X_ML.inverse() * (frames.pose(frame, owner) * pose);
      };
      const int index = static_cast<int>(model->links.size());
      Link link = read_link(*child, in_link, where + "/link " + required_name(*child), context_,
                            index, model->sensors);
      link.name = dotted(link.name);
      link.X_ML = X_ML;
      model->links.push_back(std::move(link));
    } else if (next_nested < nested.size() &&
               (child->name == "model" || child->name == "include") &&
               model->links.size() == nested[next_nested].first_link) {
      const Nested& part = nested[next_nested];
      // A part that is missing left no entry: this one is told by whose element it is.
      if (!frames.is_from(part.name, *child)) continue;
      ++next_nested;
      const Pose X_MN = frames.pose(part.name, *child);
      append_nested(part, X_MN, *model, context_.findings);
      if (part.scope->model->is_static) {
        for (size_t i = 0; i < part.scope->model->links.size(); ++i) {
          const int link = static_cast<int>(part.first_link + i);
          anchors.push_back(anchor(model->links[static_cast<size_t>(link)].name, link,
                                   model->links[static_cast<size_t>(link)].X_ML, child->source));
        }
      } else {
        all_static = false;
      }
    }
  }
  if (all_static) model->is_static = true;

  read_joints(element, version, frames, left_out, parts_missing, where, *model);
  if (!model->is_static) model->joints.insert(model->joints.end(), anchors.begin(), anchors.end());

  read_plugin_sensors(element, frames, where, *model);
  read_labels_and_temperatures(element, where, context_.findings, *model);

  // Every name's pose and link, for whoever nests or places this model.
  for (const std::string& name : frames.names()) {
    read_or_leave_out(where, "the frame '" + name + "' is left out", context_.findings, [&] {
      scope->frames[name] = {frames.pose(name, element), frames.link(name, element)};
    });
  }
  int canonical = first_own_link >= 0 ? first_own_link : 0;
  if (const std::string* name = element.attribute("canonical_link"); name && !name->empty()) {
    read_or_leave_out(where, "its first link is taken", context_.findings, [&] {
      const int link = frames.link(*name, element);
      if (link < 0) element.fail("canonical_link '" + *name + "' is no link");
      canonical = link;
    });
  }
  bring_to_front(canonical, *scope, *model);
  make_sensor_names_unique(*model, where, context_.findings);
  read_drive_of(element, where, context_, *model);
  model->commanded |= element.has("ruedo:joints");
  model->commanded &= !model->is_static && std::any_of(model->joints.begin(), model->joints.end(),
                                                       [](const Joint& joint) {
                                                         return joint.type != JointType::fixed;
                                                       });
  for (const char* name : {"ruedo:path", "ruedo:belt", "ruedo:door"}) {
    const Element* path = element.child(name);
    if (!path) continue;
    if (model->path) path->fail("a model has one of <ruedo:path>, <ruedo:belt> and <ruedo:door>");
    if (path->name == "ruedo:path") path->refuse_unknown({"ruedo:waypoint", "ruedo:loop"}, false);
    model->path = path->clone();
    model->is_static = false;
  }
  if (model->path) {
    for (Link& link : model->links) link.kinematic = true;
  }
  scope->model = std::move(model);
  return scope;
}

void SdfReader::read_plugin_sensors(const Element& element, FrameGraph& frames,
                                    const std::string& where, Model& model) {
  for (const Element* plugin : element.all("plugin")) {
    read_or_leave_out(where, "the sensor is left out", context_.findings, [&] {
      const PluginSensor made = sensor_from_plugin(*plugin, where, context_.findings);
      if (!made.sensor) return;
      const Pose pose = made.sensor->pose("pose");
      if (made.joint.empty()) {
        const int link = made.link.empty() ? 0 : frames.link(made.link, *plugin);
        if (link < 0) plugin->fail("'" + made.link + "' is no link");
        model.sensors.push_back(read_sensor(*made.sensor, link, pose));
        return;
      }
      const auto joint =
          std::find_if(model.joints.begin(), model.joints.end(),
                       [&](const Joint& each) { return each.name == dotted(made.joint); });
      if (joint == model.joints.end()) plugin->fail("'" + made.joint + "' is no joint");
      model.sensors.push_back(joint_sensor(*made.sensor, *joint, joint->X_MJ * pose, model));
    });
  }
}

void SdfReader::read_joints(const Element& element, SdfVersion version, FrameGraph& frames,
                            const std::set<const Element*>& left_out, bool parts_missing,
                            const std::string& where, Model& model) {
  for (const auto& child : element.children) {
    if (child->name != "joint" || left_out.count(child.get())) continue;
    const std::string name = required_name(*child), here = where + "/joint " + name;
    if (parts_missing) {
      // What was not found may have held its links.
      const std::string parent = joint_end(*child, "parent"), end = joint_end(*child, "child");
      if ((parent != "world" && !frames.has(parent)) || !frames.has(end)) {
        context_.findings.error(
            child->source, here,
            "it joins a link of a part that was not found; the joint is left out");
        frames.drop(name);
        continue;
      }
    }
    const bool read = read_or_leave_out(here, "the joint is left out", context_.findings, [&] {
      model.joints.push_back(read_joint(*child, version, frames, model.links, here, context_));
    });
    if (!read) {
      frames.drop(name);
      continue;
    }
    for (const Element* sensor : child->all("sensor")) {
      read_or_leave_out(here, "the sensor is left out", context_.findings,
                        [&] { read_joint_sensor(*sensor, frames, model); });
    }
  }
  for (const auto& child : element.children) {
    if (child->name != "joint") continue;
    const std::string name = dotted(required_name(*child));
    const auto joint = std::find_if(model.joints.begin(), model.joints.end(),
                                    [&](const Joint& each) { return each.name == name; });
    if (joint == model.joints.end()) continue;
    read_or_leave_out(where + "/joint " + name, "the joint moves on its own", context_.findings,
                      [&] { read_mimic(*child, model.joints, *joint); });
  }
}

}  // namespace ruedo::model
