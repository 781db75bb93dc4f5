// Converts URDF to SDF elements. urdfdom parses the robot; the element tree provides line numbers.
#include "world/urdf/urdf.h"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include <console_bridge/console.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include "base/text.h"
#include "base/xml.h"
#include "world/document/degrees.h"
#include "world/drives/drive.h"
#include "world/read/no_effect.h"
#include "world/read/read_context.h"
#include "world/urdf/urdf_format.h"
#include "world/urdf/urdf_repair.h"

namespace ruedo::world {
namespace {

// Collects what urdfdom logs instead of throwing.
class Listener : public console_bridge::OutputHandler {
 public:
  Listener() { console_bridge::useOutputHandler(this); }
  ~Listener() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    constexpr size_t kMost = 1000;
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && errors.size() < kMost)
      errors.push_back(text);
  }
  std::vector<std::string> errors;
};

// Serialises elements for urdfdom, without the parts it does not read.
void write_xml(const Element& element, std::string& out) {
  if (element.name == "gazebo" || element.name == "transmission" || element.name == "ros2_control")
    return;
  out += "<" + element.name;
  for (const auto& [name, value] : element.attributes)
    out += " " + name + "=\"" + xml_escaped(value) + "\"";
  out += ">" + xml_escaped(element.text);
  for (const auto& child : element.children) write_xml(*child, out);
  out += "</" + element.name + ">";
}

Element& add(Element& parent, const char* name, const Source& source,
             const std::string& text = "") {
  auto child = std::make_unique<Element>();
  child->name = name;
  child->text = text;
  child->source = source;
  parent.children.push_back(std::move(child));
  return *parent.children.back();
}

std::string numbers(std::initializer_list<double> values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + shown(value);
  return text;
}

void add_pose(Element& parent, const urdf::Pose& pose, const Source& source,
              const std::string& relative_to = "") {
  const auto& p = pose.position;
  const auto& q = pose.rotation;
  Element& element = add(parent, "pose", source, numbers({p.x, p.y, p.z, q.x, q.y, q.z, q.w}));
  element.attributes.emplace_back("rotation_format", "quat_xyzw");
  if (!relative_to.empty()) element.attributes.emplace_back("relative_to", relative_to);
}

void add_geometry(Element& parent, const urdf::Geometry* geometry, const Source& source) {
  Element& element = add(parent, "geometry", source);
  if (!geometry) return;
  switch (geometry->type) {
    case urdf::Geometry::BOX: {
      const auto& dim = static_cast<const urdf::Box*>(geometry)->dim;
      add(add(element, "box", source), "size", source, numbers({dim.x, dim.y, dim.z}));
      break;
    }
    case urdf::Geometry::SPHERE:
      add(add(element, "sphere", source), "radius", source,
          shown(static_cast<const urdf::Sphere*>(geometry)->radius));
      break;
    case urdf::Geometry::CYLINDER: {
      const auto* cylinder = static_cast<const urdf::Cylinder*>(geometry);
      Element& shape = add(element, "cylinder", source);
      add(shape, "radius", source, shown(cylinder->radius));
      add(shape, "length", source, shown(cylinder->length));
      break;
    }
    case urdf::Geometry::MESH: {
      const auto* mesh = static_cast<const urdf::Mesh*>(geometry);
      Element& shape = add(element, "mesh", source);
      add(shape, "uri", source, mesh->filename);
      add(shape, "scale", source, numbers({mesh->scale.x, mesh->scale.y, mesh->scale.z}));
      break;
    }
  }
}

// The contents of the <gazebo reference="NAME"> blocks of a link.
struct GazeboLink {
  std::vector<const Element*> sensors;
  std::vector<const Element*> as_written;  // elements of an SDF link, inserted as in Gazebo
  const Element* colour = nullptr;         // <visual><material>
  const Element* fdir1 = nullptr;
  const Element* material = nullptr;
  const Element* mu1 = nullptr;
  const Element* mu2 = nullptr;
  const Element* kp = nullptr;
  const Element* kd = nullptr;
  const Element* gravity_off = nullptr;
};

// A root link of this name is the world: its children are fixed to the world by their joints, as in
// Gazebo.
constexpr const char* kWorld = "world";

std::string name_of(const Element& link_or_joint) {
  const std::string* name = link_or_joint.attribute("name");
  return link_or_joint.name == "link" && name && *name == kWorld ? kWorld
                                                                 : required_name(link_or_joint);
}

// In <gazebo>, a value is an attribute or text.
std::string value_of(const Element& element) {
  const std::string* value = element.attribute("value");
  return value ? *value : element.text;
}

// Settings of Gazebo's contact and joint solvers that have no counterpart here.
constexpr std::string_view kOfSolvers[] = {"minDepth",
                                           "min_depth",
                                           "maxVel",
                                           "max_vel",
                                           "maxContacts",
                                           "max_contacts",
                                           "stopCfm",
                                           "stopErp",
                                           "stopKd",
                                           "stopKp",
                                           "fudgeFactor",
                                           "fudge_factor",
                                           "cfmDamping",
                                           "implicitSpringDamper",
                                           "provideFeedback",
                                           "preserveFixedJoint",
                                           "disableFixedJointLumping"};
// The elements that a link's SDF takes over unchanged.
constexpr std::string_view kOfLinks[] = {
    "gravity", "self_collide",   "selfCollide", "enable_wind", "kinematic",    "light",
    "battery", "velocity_decay", "projector",   "audio_sink",  "audio_source", "particle_emitter"};

template <size_t kCount>
bool is_one_of(const std::string_view (&names)[kCount], const std::string& name) {
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

struct Converter {
  const Element& robot;
  Findings& findings;
  const urdf::ModelInterface& urdf;
  std::map<std::string, GazeboLink> gazebo;
  std::map<std::string, std::vector<const Element*>> joint_sensors = {};
  std::map<std::string, std::vector<const Element*>> springs = {};  // by joint
  std::unique_ptr<Element> model = std::make_unique<Element>();

  void read_gazebo() {
    for (const Element* block : robot.all("gazebo")) {
      const std::string* reference = block->attribute("reference");
      if (!reference || reference->empty()) {
        for (const auto& child : block->children) read_of_robot(*child);
        continue;
      }
      const bool of_link = urdf.getLink(*reference) != nullptr;
      if (!of_link && !urdf.getJoint(*reference)) {
        findings.error(
            block->source, "robot " + urdf.getName(),
            "<gazebo reference=\"" + *reference + "\">: there is no link or joint of that name");
        continue;
      }
      const std::string inside = " in <gazebo reference=\"" + *reference + "\">";
      for (const auto& child : block->children) {
        if (is_one_of(kOfSolvers, child->name)) continue;
        if (!(of_link ? read_of_link(*child, gazebo[*reference], inside)
                      : read_of_joint(*child, *reference)))
          findings.unsupported(child->source, "robot " + urdf.getName(),
                               "<" + child->name + ">" + inside + " is not supported and left out");
      }
    }
  }

  // As in Gazebo, of several the last one counts, in whichever block it is.
  void take(const Element& child, const std::string& inside, const Element*& place) {
    if (place && value_of(*place) != value_of(child))
      findings.unsupported(child.source, "robot " + urdf.getName(),
                           "a second <" + child.name + ">" + inside + "; the last one counts");
    place = &child;
  }

  void read_of_robot(const Element& child) {
    const std::string& name = child.name;
    if (name == "plugin" || name == "static" || name == "self_collide" || name == "enable_wind" ||
        name == "allow_auto_disable" || name.rfind("ruedo:", 0) == 0) {
      model->children.push_back(child.clone());
    } else if (name.find(':') == std::string::npos) {
      findings.unsupported(child.source, "robot " + urdf.getName(),
                           "<" + name + "> in <gazebo> is not supported and left out");
    }
  }

  bool read_of_joint(const Element& child, const std::string& joint) {
    if (child.name == "sensor")
      joint_sensors[joint].push_back(&child);
    else if (child.name == "springStiffness" || child.name == "springReference")
      springs[joint].push_back(&child);
    else
      return false;
    return true;
  }

  bool read_of_link(const Element& child, GazeboLink& link, const std::string& inside) {
    const std::string& name = child.name;
    const std::pair<std::string_view, const Element**> single[] = {
        {"mu1", &link.mu1},
        {"mu2", &link.mu2},
        {"kp", &link.kp},
        {"kd", &link.kd},
        {"fdir1", &link.fdir1},
        {"turnGravityOff", &link.gravity_off},
        {"material", &link.material}};
    for (const auto& [known, place] : single) {
      if (name != known) continue;
      take(child, inside, *place);
      return true;
    }
    if (name == "sensor")
      link.sensors.push_back(&child);
    else if (name == "visual" && child.has("material"))
      link.colour = child.child("material");
    else if (name == "plugin")
      model->children.push_back(child.clone());
    else if (is_one_of(kOfLinks, name))
      link.as_written.push_back(&child);
    else
      return false;
    return true;
  }

  void add_inertial(Element& link, const urdf::Link& from, const Source& source) {
    // A link without mass is a frame: light enough not to matter, heavy enough for the physics
    // engine.
    constexpr double kFrameMass_kg = 1e-3, kFrameInertia = 1e-6;
    Element& inertial = add(link, "inertial", source);
    if (from.inertial && from.inertial->mass < 0)
      findings.error(source, "link " + from.name,
                     "<mass>: '" + shown(from.inertial->mass) +
                         "' is not allowed; allowed is a number of at least 0; it is taken for a "
                         "frame without mass");
    double mass = kFrameMass_kg;
    double ixx = kFrameInertia, iyy = kFrameInertia, izz = kFrameInertia, ixy = 0, ixz = 0, iyz = 0;
    if (from.inertial && from.inertial->mass > 0) {
      const urdf::Inertial& i = *from.inertial;
      add_pose(inertial, i.origin, source);
      mass = i.mass;
      ixx = i.ixx, iyy = i.iyy, izz = i.izz, ixy = i.ixy, ixz = i.ixz, iyz = i.iyz;
    }
    add(inertial, "mass", source, shown(mass));
    Element& inertia = add(inertial, "inertia", source);
    const std::pair<const char*, double> moments[] = {{"ixx", ixx}, {"iyy", iyy}, {"izz", izz},
                                                      {"ixy", ixy}, {"ixz", ixz}, {"iyz", iyz}};
    for (const auto& [name, value] : moments) add(inertia, name, source, shown(value));
  }

  // urdfdom takes the first colour of a name, wherever it is in the file.
  void name_colour(const Element& written, const urdf::Visual& from, const std::string& link) {
    const Element* material = written.child("material");
    if (!material || from.material_name.empty()) return;
    const std::string name = "the material '" + from.material_name + "' ";
    if (!from.material)
      return findings.error(material->source, "link " + link,
                            name + "is not defined; the colour is grey instead");
    const Element* own = material->child("color");
    const std::string* rgba = own ? own->attribute("rgba") : nullptr;
    if (!rgba) return;
    Element written_there = Element();
    written_there.text = *rgba;
    const std::vector<double> v = written_there.as_numbers(Allowed::any(quantity::kBrightness));
    const urdf::Color& c = from.material->color;
    const auto counts = numbers({c.r, c.g, c.b, c.a});
    if (v.size() == 4 && numbers({static_cast<float>(v[0]), static_cast<float>(v[1]),
                                  static_cast<float>(v[2]), static_cast<float>(v[3])}) != counts)
      findings.unsupported(own->source, "link " + link,
                           name + "has another colour already, " + counts + ", which counts");
  }

  void add_material(Element& visual, const urdf::Visual& from, const GazeboLink& block,
                    const Source& source) {
    if (block.material && !value_of(*block.material).empty()) {
      add(add(add(visual, "material", source), "script", source), "name", source,
          value_of(*block.material));
      return;
    }
    if (!from.material) return;
    const auto& c = from.material->color;
    Element& material = add(visual, "material", source);
    const std::string& texture = from.material->texture_filename;
    const std::string colour = texture.empty() ? numbers({c.r, c.g, c.b, c.a}) : "1 1 1 1";
    add(material, "ambient", source, colour);
    add(material, "diffuse", source, colour);
    if (!texture.empty())
      add(add(add(material, "pbr", source), "metal", source), "albedo_map", source, texture);
  }

  static void add_surface(Element& collision, const GazeboLink& block, const Source& source) {
    const auto add_ode = [&](const char* part,
                             std::initializer_list<std::pair<const char*, const Element*>> values) {
      if (std::none_of(values.begin(), values.end(), [](const auto& each) { return each.second; }))
        return;
      Element* surface = collision.child("surface");
      if (!surface) surface = &add(collision, "surface", source);
      Element& ode = add(add(*surface, part, source), "ode", source);
      for (const auto& [name, written] : values) {
        if (written) add(ode, name, written->source, value_of(*written));
      }
    };
    add_ode("friction", {{"mu", block.mu1}, {"mu2", block.mu2}, {"fdir1", block.fdir1}});
    add_ode("contact", {{"kp", block.kp}, {"kd", block.kd}});
  }

  static void add_what_gazebo_adds(Element& link, const GazeboLink& block) {
    for (const Element* sensor : block.sensors) link.children.push_back(sensor->clone());
    for (const Element* written_there : block.as_written) {
      link.children.push_back(written_there->clone());
      Element& last = *link.children.back();
      if (last.name == "selfCollide") last.name = "self_collide";
      last.text = value_of(*written_there);
    }
  }

  void add_link(const Element& written) {
    const urdf::LinkConstSharedPtr from = urdf.getLink(name_of(written));
    if (!from) return;
    if (from->name == kWorld) {
      if (from->parent_joint)
        written.fail(
            "'world' is a reserved name; only the root of all links may have it, which then is the "
            "world");
      if (!from->collision_array.empty() || !from->visual_array.empty() ||
          !gazebo[kWorld].sensors.empty()) {
        findings.unsupported(
            written.source, "robot " + urdf.getName(),
            "the link 'world' is the world itself; its shapes and sensors are left out");
      }
      return;
    }
    const GazeboLink& block = gazebo[from->name];
    Element& link = add(*model, "link", written.source);
    link.attributes.emplace_back("name", from->name);
    if (from->parent_joint) {
      const std::string& parent = from->parent_joint->parent_link_name;
      add_pose(link, from->parent_joint->parent_to_joint_origin_transform, written.source,
               parent == kWorld ? "" : parent);
    }
    if (block.gravity_off) {
      const auto off = block.gravity_off->clone();
      off->text = value_of(*off);
      add(link, "gravity", off->source, off->as_boolean() ? "false" : "true");
    }
    add_inertial(link, *from,
                 written.child("inertial") ? written.child("inertial")->source : written.source);
    const auto lines = [&](const char* name, size_t i) {
      const auto all = written.all(name);
      return i < all.size() ? all[i]->source : written.source;
    };
    for (size_t i = 0; i < from->collision_array.size(); ++i) {
      const Source source = lines("collision", i);
      Element& collision = add(link, "collision", source);
      collision.attributes.emplace_back("name",
                                        i == 0 ? "collision" : "collision_" + std::to_string(i));
      add_pose(collision, from->collision_array[i]->origin, source);
      add_geometry(collision, from->collision_array[i]->geometry.get(), source);
      add_surface(collision, block, source);
    }
    for (size_t i = 0; i < from->visual_array.size(); ++i) {
      const Source source = lines("visual", i);
      const auto seen = written.all("visual");
      if (!block.colour && !block.material && i < seen.size())
        name_colour(*seen[i], *from->visual_array[i], from->name);
      Element& visual = add(link, "visual", source);
      visual.attributes.emplace_back("name", i == 0 ? "visual" : "visual_" + std::to_string(i));
      add_pose(visual, from->visual_array[i]->origin, source);
      add_geometry(visual, from->visual_array[i]->geometry.get(), source);
      if (block.colour)
        visual.children.push_back(block.colour->clone());
      else
        add_material(visual, *from->visual_array[i], block, source);
    }
    add_what_gazebo_adds(link, block);
  }

  void add_joint(const Element& written) {
    const urdf::JointConstSharedPtr from = urdf.getJoint(required_name(written));
    if (!from) return;
    static const std::map<int, const char*> kTypes = {{urdf::Joint::FIXED, "fixed"},
                                                      {urdf::Joint::REVOLUTE, "revolute"},
                                                      {urdf::Joint::CONTINUOUS, "continuous"},
                                                      {urdf::Joint::PRISMATIC, "prismatic"},
                                                      {urdf::Joint::PLANAR, "planar"}};
    const auto type = kTypes.find(from->type);
    if (type == kTypes.end()) return;  // floating: no constraint
    const Source& source = written.source;
    Element& joint = add(*model, "joint", source);
    joint.attributes.emplace_back("name", from->name);
    joint.attributes.emplace_back("type", type->second);
    add(joint, "parent", source, from->parent_link_name);
    add(joint, "child", source, from->child_link_name);
    for (const Element* sensor : joint_sensors[from->name])
      joint.children.push_back(sensor->clone());
    if (from->type == urdf::Joint::FIXED) return;
    Element& axis = add(joint, "axis", source);
    add(axis, "xyz", source, numbers({from->axis.x, from->axis.y, from->axis.z}));
    if (from->limits) {
      Element& limit = add(axis, "limit", source);
      if (from->type != urdf::Joint::CONTINUOUS || from->limits->lower < from->limits->upper) {
        add(limit, "lower", source, shown(from->limits->lower));
        add(limit, "upper", source, shown(from->limits->upper));
      }
      // URDF requires both; robots that were never simulated have zeroes there.
      if (from->limits->effort > 0) add(limit, "effort", source, shown(from->limits->effort));
      if (from->limits->velocity > 0) add(limit, "velocity", source, shown(from->limits->velocity));
    }
    if (from->dynamics) {
      Element& dynamics = add(axis, "dynamics", source);
      add(dynamics, "damping", source, shown(from->dynamics->damping));
      add(dynamics, "friction", source, shown(from->dynamics->friction));
    }
    for (const Element* spring : springs[from->name]) {
      Element* dynamics = axis.child("dynamics");
      if (!dynamics) dynamics = &add(axis, "dynamics", source);
      add(*dynamics, spring->name == "springStiffness" ? "spring_stiffness" : "spring_reference",
          spring->source, value_of(*spring));
    }
    if (const Element* mimic = written.child("mimic"); mimic && from->mimic) {
      Element& follows = add(axis, "mimic", mimic->source);
      follows.attributes.emplace_back("joint", from->mimic->joint_name);
      add(follows, "multiplier", mimic->source, shown(from->mimic->multiplier));
      add(follows, "offset", mimic->source, shown(from->mimic->offset));
    }
  }
};

void refuse_xacro(const Element& element) {
  if (element.name.rfind("xacro:", 0) == 0) {
    element.fail("is xacro; expand it first: xacro FILE > robot.urdf");
  }
  for (const auto& child : element.children) refuse_xacro(*child);
}

// urdfdom names the faulty part without its line: finds the link or joint whose name its message
// has in brackets or quotes.
const Element& whom_it_names(const std::string& fault, const Element& robot) {
  for (const char* kind : {"joint", "link"}) {
    for (const Element* each : robot.all(kind)) {
      const std::string name = name_of(*each);
      for (const char* quotes : {"[]", "''", "\"\""}) {
        if (fault.find(quotes[0] + name + quotes[1]) != std::string::npos) return *each;
      }
    }
  }
  return robot;
}

struct Parsed {
  urdf::ModelInterfaceSharedPtr model;  // null: urdfdom refused the robot
  std::vector<std::string> errors;      // its messages
};

Parsed parse(const Element& robot) {
  std::string text;
  write_xml(robot, text);
  Parsed parsed;
  Listener listener;
  try {
    parsed.model = urdf::parseURDF(text);
  } catch (const std::exception& error) {
    listener.errors.insert(listener.errors.begin(), error.what());
  }
  parsed.errors = std::move(listener.errors);
  return parsed;
}

// The part of a link at which urdfdom stopped, since it drops everything after a fault; null: it
// read all parts. It reads the inertia first, then visuals, then collisions.
const Element* faulty_part(const Element& link, const urdf::Link& read,
                           const std::set<std::string>& of_bad_inertia) {
  if (link.has("inertial") && of_bad_inertia.count(name_of(link)) > 0)
    return link.child("inertial");
  const auto seen = link.all("visual"), solid = link.all("collision");
  if (read.visual_array.size() < seen.size()) return seen[read.visual_array.size()];
  if (read.collision_array.size() < solid.size()) return solid[read.collision_array.size()];
  return nullptr;
}

// Removes the parts that urdfdom cannot parse, so that it parses the others; true if there were
// any.
bool leave_out_faults(Element& robot, const Parsed& parsed, Findings& findings) {
  constexpr size_t kMostSaid = 300;
  std::string said;
  std::set<std::string> of_bad_inertia;  // links: "... inertial element for Link [NAME]"
  for (const std::string& error : parsed.errors) {
    if (said.size() <= kMostSaid) said += (said.empty() ? "" : "; ") + error;
    const size_t open = error.rfind('['), close = error.rfind(']');
    if (error.find("inertial") != std::string::npos && open < close)
      of_bad_inertia.insert(error.substr(open + 1, close - open - 1));
  }
  if (said.size() > kMostSaid) said.replace(kMostSaid, std::string::npos, " ...");
  bool any = false;
  for (const auto& link : robot.children) {
    const urdf::LinkConstSharedPtr read =
        link->name == "link" ? parsed.model->getLink(name_of(*link)) : nullptr;
    const Element* fault = read ? faulty_part(*link, *read, of_bad_inertia) : nullptr;
    if (!fault) continue;
    findings.error(fault->source, "link " + name_of(*link),
                   "this <" + fault->name + "> is left out, urdfdom cannot read it: " +
                       (said.empty() ? "it does not say why" : said));
    std::erase_if(link->children, [&](const auto& child) { return child.get() == fault; });
    any = true;
  }
  return any;
}

}  // namespace

std::unique_ptr<Element> urdf_as_sdf(const Element& written, Findings& findings) {
  const std::unique_ptr<Element> kept = written.clone();
  Element& robot = *kept;
  refuse_xacro(robot);
  if (!robot.attribute("name") && !robot.child("link"))
    robot.fail("has no name and no link; a file of xacro macros alone is for others to include");
  const std::string name = required_name(robot);
  repair_urdf(robot, findings);
  Parsed parsed = parse(robot);
  constexpr int kMostFaults = 20;  // per link
  for (int i = 0; i < kMostFaults && parsed.model && parsed.model->getRoot() &&
                  leave_out_faults(robot, parsed, findings);
       ++i)
    parsed = parse(robot);
  const urdf::ModelInterfaceSharedPtr& urdf = parsed.model;
  const std::string fault = parsed.errors.empty() ? "unknown reason" : parsed.errors.front();
  if (!urdf || !urdf->getRoot())
    whom_it_names(fault, robot).fail("urdfdom cannot read it: " + fault);

  name_what_urdf_lacks(robot, findings);
  name_degrees(robot, findings);
  Converter converter{robot, findings, *urdf, {}};
  Element& model = *converter.model;
  model.name = "model";
  model.source = robot.source;
  model.attributes.emplace_back("name", name);
  if (urdf->getRoot()->name != kWorld)
    model.attributes.emplace_back("canonical_link", urdf->getRoot()->name);
  converter.read_gazebo();
  for (const Element* link : robot.all("link")) converter.add_link(*link);
  for (const Element* joint : robot.all("joint")) converter.add_joint(*joint);
  for (const char* kind : {"transmission", "ros2_control"}) {  // needed by the drive's reader
    for (const Element* each : robot.all(kind)) model.children.push_back(each->clone());
  }
  if (!model.has("ruedo:joints"))
    // makes any <robot> a robot, even an arm without sensors
    add(model, "ruedo:joints", robot.source).attributes.emplace_back(kImplied, "");
  Element sdf;
  sdf.name = "sdf";
  sdf.children.push_back(std::move(converter.model));
  name_what_has_no_effect(sdf, findings);
  return std::move(sdf.children.front());
}

}  // namespace ruedo::world
