// Matches elements with models by the file and line that a model came from, and its name; each
// change then replaces a few bytes.
#include "world/edit/world_text.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include <fmt/format.h>

#include "base/input_file.h"
#include "base/xml.h"
#include "ruedo/math.h"
#include "world/document/document.h"
#include "world/document/resources.h"
#include "world/document/sdf_version.h"
#include "world/read/read_context.h"
#include "world/urdf/urdf.h"

namespace fs = std::filesystem;

namespace ruedo::world {

const char* const kEmptyWorld = R"(<?xml version="1.0"?>
<sdf version="1.9">
  <world name="empty">
    <light name="sun" type="directional">
      <cast_shadows>true</cast_shadows>
      <pose>0 0 10 0 0 0</pose>
      <diffuse>0.8 0.8 0.8 1</diffuse>
      <specular>0.2 0.2 0.2 1</specular>
      <direction>-0.5 0.1 -0.9</direction>
    </light>
    <model name="ground_plane">
      <static>true</static>
      <link name="link">
        <collision name="collision">
          <geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>
        </collision>
        <visual name="visual">
          <geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>
          <material><ambient>0.8 0.8 0.8 1</ambient><diffuse>0.8 0.8 0.8 1</diffuse></material>
        </visual>
      </link>
    </model>
  </world>
</sdf>
)";

namespace {

constexpr double kSettled_m = 1e-3, kSettled_rad = 1e-3;  // displacements by the solver
constexpr double kPut_m = 1e-6, kPut_rad = 1e-6;

bool same_place(const Pose& a, const Pose& b, bool exactly) {
  return (a.translation - b.translation).norm() <= (exactly ? kPut_m : kSettled_m) &&
         a.rotation.angularDistance(b.rotation) <= (exactly ? kPut_rad : kSettled_rad);
}

// To a micrometre, without trailing zeros.
std::string number(double value) {
  std::string text = fmt::format("{:.6f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string pose_text(const Pose& X) {
  const Eigen::Matrix3d R = X.rotation.toRotationMatrix();
  const double level = math::hypot(R(0, 0), R(1, 0));
  const bool upright = level < 1e-9;  // roll and yaw are about the same axis: only yaw is written
  const double roll = upright ? 0.0 : math::atan2(R(2, 1), R(2, 2));
  const double pitch = math::atan2(-R(2, 0), level);
  const double yaw = upright ? math::atan2(-R(0, 1), R(1, 1)) : math::atan2(R(1, 0), R(0, 0));
  std::string text;
  for (const double value :
       {X.translation.x(), X.translation.y(), X.translation.z(), roll, pitch, yaw})
    text += (text.empty() ? "" : " ") + number(value);
  return text;
}

// The indentation before an element that begins a line, with the preceding line end.
std::string gap_before(const std::string& text, const TextElement& element) {
  const size_t last = text.find_last_not_of(" \t\r\n", element.begin - 1);
  const size_t begin = last == std::string::npos ? 0 : last + 1;
  const size_t line = text.rfind('\n', element.begin);
  return line != std::string::npos && line >= begin ? text.substr(line, element.begin - line) : "";
}

// Replaces a child's text, or adds a child.
void set_child(const std::string& text, const TextElement& of, const std::string& name,
               const std::string& value, TextPatch& patch) {
  const std::string written = "<" + name + ">" + value + "</" + name + ">";
  if (const TextElement* child = of.child(name)) {
    // Its attributes said in which frame and format the old value was.
    if (child->closed() || !child->attributes.empty())
      patch.replace(child->begin, child->end, written);
    else
      patch.replace(child->inside, child->past, value);
    return;
  }
  for (const char* before : {"uri", "static"}) {
    if (const TextElement* sibling = of.child(before))
      return patch.insert(sibling->end, gap_before(text, *sibling) + written);
  }
  if (of.closed()) return patch.replace(of.end - 2, of.end, ">" + written + "</" + of.name + ">");
  if (of.children.empty()) return patch.insert(of.inside, written);
  patch.insert(of.children.front().begin, written + gap_before(text, of.children.front()));
}

void drop_child(const TextElement& of, const char* name, TextPatch& patch) {
  if (const TextElement* child = of.child(name)) patch.replace(child->begin, child->end, "");
}

// A <model> or <include> there.
void put(const std::string& text, const TextElement& element, const Pose& X_WM, TextPatch& patch) {
  set_child(text, element, "pose", pose_text(X_WM), patch);
  drop_child(element, "placement_frame", patch);  // the pose is that of the model's own frame
  if (const auto* frame = element.attribute("placement_frame"))
    patch.replace(frame->begin, frame->end, "");
}

void call(const std::string& text, const TextElement& element, const std::string& name,
          TextPatch& patch) {
  if (element.name == "include") return set_child(text, element, "name", xml_escaped(name), patch);
  if (const auto* written = element.attribute("name"))
    patch.replace(written->value, written->past, xml_escaped(name));
}

// Elements as text, for sources that are not SDF.
std::string written(const Element& element, const std::string& indent) {
  std::string text = indent + "<" + element.name;
  for (const auto& [name, value] : element.attributes)
    text += " " + name + "=\"" + xml_escaped(value) + "\"";
  if (element.children.empty())
    return text + (element.text.empty()
                       ? "/>"
                       : ">" + xml_escaped(element.text) + "</" + element.name + ">");
  text += ">";
  if (!element.text.empty()) text += xml_escaped(element.text);
  for (const auto& child : element.children) text += "\n" + written(*child, indent + "  ");
  return text + "\n" + indent + "</" + element.name + ">";
}

// Before SDF 1.5 axes were in the model's frame, since then in the joint's. Each axis gets its
// frame explicitly, so that the text means the same in a file of the other kind.
void say_frames_of_axes(const std::string& text, const Element& element, const TextElement& place,
                        bool in_model, TextPatch& patch) {
  for (size_t i = 0; i < element.children.size(); ++i) {
    const Element& child = *element.children[i];
    say_frames_of_axes(text, child, place.children[i], in_model, patch);
    if (element.name != "joint" || (child.name != "axis" && child.name != "axis2")) continue;
    const Element* xyz = child.child("xyz");
    const std::string* joint = element.attribute("name");
    if (!joint || (xyz && xyz->attribute("expressed_in"))) continue;
    const bool of_model = in_model || child.boolean("use_parent_model_frame", false);
    const std::string said =
        " expressed_in=\"" + (of_model ? "__model__" : xml_escaped(*joint)) + "\"";
    const TextElement& axis = place.children[i];
    const TextElement* written = axis.child("xyz");
    if (written)
      patch.insert(text.find(written->name, written->begin) + written->name.size(), said);
    else if (axis.closed())
      patch.replace(axis.end - 2, axis.end, "><xyz" + said + ">0 0 1</xyz></" + axis.name + ">");
    else
      patch.insert(axis.inside, "<xyz" + said + ">0 0 1</xyz>");
  }
}

bool has_axes_in_model(const Element& root) {
  const std::string* version = root.attribute("version");
  return version && SdfVersion::parse(*version).value_or(SdfVersion{}) < SdfVersion{1, 5};
}

// The element of a spawned model, as written in a world file. in_model: the file's axes are.
std::string element_of(const ModelNow& model, bool in_model) {
  const std::string what = "the model '" + model.name + "'";
  std::string text = model.spawned;
  const auto document = parse_document(text, what);
  const bool own_in_model = has_axes_in_model(*document);
  if (document->name == "robot") {
    Findings findings;
    text =
        "<sdf version=\"1.9\">\n" + written(*urdf_as_sdf(*document, findings), "    ") + "\n</sdf>";
  }
  const TextElement root = places_in(text);
  const TextElement* element = root.child("model");
  if (!element) element = root.child("include");
  if (!element) throw InputError({what, 0}, "its text holds no <model> that a file could have");
  TextPatch patch;
  call(text, *element, model.name, patch);
  const auto parsed = parse_document(text, what);
  const Element* own = parsed->child(element->name);
  const Element* written_pose = own->child("pose");
  if (own_in_model != in_model) say_frames_of_axes(text, *own, *element, own_in_model, patch);
  const bool framed = written_pose && !written_pose->attributes.empty();
  if (!written_pose || framed || !same_place(written_pose->as_pose(), model.X_WM, true))
    put(text, *element, model.X_WM, patch);
  const std::string changed = patch.applied_to(text);
  const TextElement again = places_in(changed);
  const TextElement* whole = again.child(element->name);
  return changed.substr(whole->begin, whole->end - whole->begin);
}

// With those elements at the end of the world.
std::string with_last(const std::string& text, const std::string& elements) {
  const TextElement root = places_in(text);
  const TextElement& world = *root.child("world");
  TextPatch patch;
  if (world.closed())
    patch.replace(world.end - 2, world.end, ">" + elements + "\n  </world>");
  else
    patch.insert(text.find_last_not_of(" \t\r\n", world.past - 1) + 1, elements);
  return patch.applied_to(text);
}

// "box_2" may be called "box" in the file.
bool may_be_called(const std::string& name, const std::string& in_file) {
  const auto plain = [](std::string text) {
    for (char& c : text)
      if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    return text;
  };
  const std::string a = plain(name), b = plain(in_file);
  if (a == b) return true;
  return a.size() > b.size() + 1 && a.compare(0, b.size(), b) == 0 && a[b.size()] == '_' &&
         a.find_first_not_of("0123456789", b.size() + 1) == std::string::npos;
}

// The first part of a name such as "table::top".
std::string outermost(const std::string& frame) { return frame.substr(0, frame.find("::")); }

std::string frame_of(const Element& element) {
  const Element* pose = element.child("pose");
  if (!pose) return "";
  const std::string* frame = pose->attribute("relative_to");
  if (!frame) frame = pose->attribute("frame");
  return frame ? outermost(*frame) : "";
}

}  // namespace

WorldText::WorldText(std::string text, const WorldModel& first)
    : text_(std::move(text)), root_(parse_document(text_, first.file)), places_(places_in(text_)) {
  world_ = root_->child("world");
  world_place_ = places_.child("world");
  if (!world_ || !world_place_) throw InputError({first.file, 0}, "holds no <world>");
  match(first);
}

void WorldText::match(const WorldModel& first) {
  const ResourceFinder resources(first.file, true);
  std::map<std::string, std::string> files;  // by the addresses looked up until now
  const auto file_of = [&](const std::string& uri) {
    const auto [at, fresh] = files.try_emplace(uri);
    if (fresh) at->second = resources.find_model(uri, first.file).value_or("");
    return at->second;
  };
  std::vector<bool> taken(first.models.size());
  size_t from = 0;  // models come in file order
  for (size_t i = 0; i < world_->children.size(); ++i) {
    const Element& element = *world_->children[i];
    if (element.name != "model" && element.name != "include") continue;
    const std::string* name = element.attribute("name");
    const std::string called =
        element.name == "model" ? (name ? *name : "") : element.string("name", "");
    const std::string file = element.name == "include" ? file_of(element.string("uri", "")) : "";
    for (size_t m = from; m < first.models.size(); ++m) {
      const ModelInstance& model = first.models[m];
      const Source& source = model.model->source;
      const bool here = element.name == "model"
                            ? source.file == first.file && source.line == element.source.line
                            : !file.empty() && source.file == file;
      if (taken[m] || !here ||
          !may_be_called(model.name, called.empty() ? model.model->name : called))
        continue;
      taken[m] = true;
      entries_.push_back({model.name, model.X_WM, &world_place_->children[i], &element});
      while (from < taken.size() && taken[from]) ++from;
      break;
    }
  }
  for (size_t m = 0; m < first.models.size(); ++m) {
    if (!taken[m]) others_.push_back(first.models[m]);
  }
}

std::string WorldText::model_text(const std::string& name) const {
  const auto found = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.name == name; });
  if (found == entries_.end()) return "";
  const std::string head = text_.substr(places_.begin, places_.inside - places_.begin);
  const TextElement& place = *found->place;
  return "<?xml version=\"1.0\"?>\n" + head + "\n" +
         text_.substr(place.begin, place.end - place.begin) + "\n</sdf>\n";
}

// Contents whose frames belong to those models now have other frames.
std::set<std::string> WorldText::moved_with(std::set<std::string> changed) const {
  for (bool more = true; more;) {
    more = false;
    for (const Element* frame : world_->all("frame")) {
      const std::string* name = frame->attribute("name");
      const std::string* attached = frame->attribute("attached_to");
      if (!name || changed.contains(*name)) continue;
      if (changed.contains(frame_of(*frame)) ||
          (attached && changed.contains(outermost(*attached))))
        more = changed.insert(*name).second;
    }
  }
  return changed;
}

// With its line, if it has one of its own.
void WorldText::drop(const TextElement& element, TextPatch& patch) const {
  size_t begin = element.begin, end = element.end;
  const size_t line = text_.find_last_not_of(" \t", begin - 1);
  const size_t rest = text_.find_first_not_of(" \t\r", end);
  if (line != std::string::npos && text_[line] == '\n' && rest != std::string::npos &&
      text_[rest] == '\n') {
    begin = line + 1;
    end = rest + 1;
  }
  patch.replace(begin, end, "");
}

void WorldText::drop_states(const std::set<std::string>& names, TextPatch& patch) const {
  for (size_t i = 0; i < world_->children.size(); ++i) {
    const Element& state = *world_->children[i];
    if (state.name != "state") continue;
    for (size_t k = 0; k < state.children.size(); ++k) {
      const std::string* name = state.children[k]->attribute("name");
      if (state.children[k]->name == "model" && name && names.contains(*name))
        drop(world_place_->children[i].children[k], patch);
    }
  }
}

WorldText::Written WorldText::with(const std::vector<ModelNow>& models) const {
  Written result;
  std::map<std::string, const ModelNow*> now;
  for (const ModelNow& model : models) now.emplace(model.name, &model);
  // A model that was removed and then restored comes from the file again.
  const auto own = [&](const ModelNow& model) {
    return model.spawned.empty() || model.spawned == model_text(model.name);
  };
  const auto is_here = [&](const std::string& name, const Pose& X_WM) {
    const auto at = now.find(name);
    return at != now.end() && own(*at->second) &&
           same_place(at->second->X_WM, X_WM, at->second->put);
  };
  std::set<std::string> changed;
  for (const Entry& entry : entries_) {
    if (!is_here(entry.name, entry.X_WM)) changed.insert(entry.name);
  }
  const std::set<std::string> moved = moved_with(changed);
  TextPatch patch;
  std::set<std::string> said;
  for (const Entry& entry : entries_) {
    said.insert(entry.name);
    const auto at = now.find(entry.name);
    if (at == now.end())
      drop(*entry.place, patch);
    else if (!own(*at->second))
      patch.replace(entry.place->begin, entry.place->end,
                    element_of(*at->second, has_axes_in_model(*root_)));
    else if (changed.contains(entry.name) || moved.contains(frame_of(*entry.element)))
      put(text_, *entry.place, at->second->X_WM, patch);
  }
  for (const ModelInstance& other : others_) {
    if (!other.model->path && !is_here(other.name, other.X_WM))
      result.left_out.push_back("'" + other.name +
                                "' has no element of its own in the file, as robots of a fleet: "
                                "what became of it is not saved");
    said.insert(other.name);
  }
  drop_states(changed, patch);
  std::string added;
  for (const ModelNow& model : models) {
    if (!said.contains(model.name))
      added += "\n    " + element_of(model, has_axes_in_model(*root_));
  }
  result.text = patch.applied_to(text_);
  if (!added.empty()) result.text = with_last(result.text, added);
  return result;
}

std::string world_text_of(const WorldModel& world) {
  constexpr size_t kMost = 64u << 20;
  const std::string text = read_input(world.file, kMost);
  const auto root = parse_document(text, world.file);
  if (root->name == "sdf" && root->has("world")) return text;
  std::string models;
  const auto place = [](const ModelInstance& model) { return pose_text(model.X_WM); };
  const bool single = root->name != "sdf" || root->all("model").size() == 1;
  if (single && !world.models.empty()) {
    const ModelInstance& model = world.models.back();
    models = "    <include>\n      <uri>" + xml_escaped(fs::path(world.file).filename().string()) +
             "</uri>\n      <name>" + xml_escaped(model.name) + "</name>\n      <pose>" +
             place(model) + "</pose>\n    </include>\n";
  } else {
    const TextElement places = places_in(text);
    for (const TextElement& child : places.children) {
      if (child.name == "model")
        models += "    " + text.substr(child.begin, child.end - child.begin) + "\n";
    }
  }
  std::string made = kEmptyWorld;
  return made.insert(made.find("  </world>"), models);
}

namespace {

// Whether an element without children names a file.
bool names_file(const Element& element, const std::string& parent) {
  return element.name == "uri" || element.name.ends_with("_map") ||
         (element.name == "diffuse" && parent == "texture") ||
         (element.name == "parameters" && parent == "plugin");
}

}  // namespace

Moved moved_to(const std::string& text, const std::string& from_file, const std::string& to_file) {
  std::error_code error;
  const fs::path from = fs::weakly_canonical(fs::absolute(from_file), error);
  const fs::path to = fs::weakly_canonical(fs::absolute(to_file), error);
  if (from.parent_path() == to.parent_path()) return {text, {}};
  const ResourceFinder here(from, false), there(to, false);
  Moved moved;
  TextPatch patch;
  const auto visit = [&](const auto& self, const Element& element, const TextElement& place,
                         const std::string& parent) -> void {
    for (size_t i = 0; i < element.children.size(); ++i)
      self(self, *element.children[i], place.children[i], element.name);
    if (!element.children.empty() || place.closed() || !names_file(element, parent)) return;
    auto file = here.find(element.text, from);
    if (!file && element.name != "uri") file = here.find_texture(element.text, from);
    if (!file || there.find(element.text, to) == file) return;
    const std::string path = fs::path(*file).lexically_relative(to.parent_path()).string();
    patch.replace(place.inside, place.past, xml_escaped(path));
    if (there.find(path, to) != file)
      moved.out_of_reach.insert(fs::path(*file).parent_path().string());
  };
  visit(visit, *parse_document(text, from), places_in(text), "");
  moved.text = patch.applied_to(text);
  return moved;
}

}  // namespace ruedo::world
