// <include>: the file, read once for all its <include>s, and the changes that each one makes.
#include <algorithm>
#include <filesystem>

#include "world/document/degrees.h"
#include "world/document/reserved_names.h"
#include "world/read/no_effect.h"
#include "world/sdf/include_params.h"
#include "world/sdf/sdf_reader.h"
#include "world/urdf/urdf.h"
#include "world/urdf/xacro.h"

namespace ruedo::world {
namespace {

constexpr const char* kParams = "experimental:params";

// Of a file that is included, the first thing counts.
void name_what_else_is_in(const Element& sdf, Findings& findings) {
  const Element* first = nullptr;
  for (const auto& child : sdf.children) {
    if (child->name != "model" && child->name != "light" && child->name != "actor" &&
        child->name != "include" && child->name != "world")
      continue;
    if (!first) {
      first = child.get();
      continue;
    }
    const std::string* name = child->attribute("name");
    findings.unsupported(child->source, "sdf",
                         "<" + child->name + ">" + (name ? " '" + *name + "'" : "") +
                             " beside the <" + first->name +
                             "> of a file that is included is left out: the first one counts");
  }
}

// The elements of an <include> that replace those of its model.
bool is_setting(const Element& child) {
  return child.name == "static" || child.name == "enable_wind" ||
         child.name == "allow_auto_disable" || child.name.rfind("ruedo:", 0) == 0;
}

}  // namespace

std::string relative_to(const Element& owner) {
  const Element* pose = owner.child("pose");
  if (!pose) return "";
  if (const std::string* frame = pose->attribute("relative_to")) return *frame;
  if (const std::string* frame = pose->attribute("frame")) return *frame;
  return "";
}

SdfVersion SdfReader::version_of(const Element& root) {
  if (root.name == "gazebo")
    root.fail(
        "this is the format of Gazebo before 1.0; Ruedo reads SDF 1.4 to 1.12 (gz sdf -p converts "
        "it)");
  if (root.name != "sdf") root.fail("is not SDF: the root element is not <sdf>");
  const std::string* written = root.attribute("version");
  if (!written)
    root.fail("has no version; the attribute version is required, as in version=\"1.9\"");
  const auto version = SdfVersion::parse(*written);
  if (!version) root.fail("version '" + *written + "' is not a version; allowed are 1.4 to 1.12");
  if (*version < SdfVersion{1, 3})
    root.fail("version '" + *written + "' is too old; allowed are 1.4 to 1.12");
  if (version->major > 1)
    root.fail("version '" + *written + "' is not known; allowed are 1.4 to 1.12");
  if (*version > SdfVersion{1, 12}) {
    context_.findings.unsupported(
        root.source, "sdf",
        "version " + *written + " is newer than 1.12; what it adds is left out");
  }
  name_what_has_no_effect(root, context_.findings);
  name_degrees(root, context_.findings);
  return *version;
}

void SdfReader::enter(const std::string& path, const Element& asker) {
  if (std::find(files_.begin(), files_.end(), path) != files_.end()) {
    std::string circle;
    for (auto at = std::find(files_.begin(), files_.end(), path); at != files_.end(); ++at) {
      circle += std::filesystem::path(*at).filename().string() + " includes ";
    }
    asker.fail("an include that never ends: " + circle +
               std::filesystem::path(path).filename().string());
  }
  files_.push_back(path);
}

SdfReader::Included SdfReader::read_file(const std::string& path, const Element& asker) {
  enter(path, asker);
  if (const auto known = cache_.find(path); known != cache_.end()) {
    leave();
    return known->second;
  }
  Included result;
  result.document = context_.documents.read(path);
  if (is_xacro(path, result.document.get())) result.document = expand_xacro(path, context_);
  std::error_code none;  // receives the error; it says which file of its folder is the model's
  const auto config = std::filesystem::path(path).parent_path() / "model.config";
  if (std::filesystem::is_regular_file(config, none)) context_.documents.note(config.string());
  if (result.document->name == "robot") {
    // A URDF, converted to an equivalent SDF file, so that an <include> can change it.
    auto converted = std::make_shared<Element>();
    converted->name = "sdf";
    converted->source = result.document->source;
    converted->children.push_back(urdf_as_sdf(*result.document, context_.findings));
    result.document = converted;
    result.version = {1, 9};
  } else {
    result.version = version_of(*result.document);
  }
  for (const auto& child : result.document->children) {
    if (child->name == "model") {
      result.model = read_model(*child, result.version);
      result.name = name_of_model(*child);
      break;
    }
    if (child->name == "light" || child->name == "actor") {
      (child->name == "light" ? result.light : result.actor) = child.get();
      result.name = required_name(*child);
      break;
    }
    if (child->name == "include") {  // in the text of a SPAWN: handled as in a world
      const auto inner = include(*child, "include");
      if (!inner) child->fail("the model that it names is not found");
      result = *inner;
      break;
    }
    if (child->name == "world")
      child->fail("is a world; only models, lights and actors can be included");
  }
  if (result.name.empty()) result.document->fail("holds no <model>, <light> or <actor>");
  name_what_else_is_in(*result.document, context_.findings);
  leave();
  return cache_[path] = result;
}

// Reads the model again with the <include>'s additions to its elements: static, plugins, sensors,
// ruedo:.
std::shared_ptr<const ScopedModel> SdfReader::read_overridden(const Element& model,
                                                              const Element& include,
                                                              SdfVersion version) {
  const auto copy = model.clone();
  const auto remove = [&](const std::string& name) {
    std::erase_if(copy->children, [&](const auto& child) { return child->name == name; });
  };
  for (const auto& child : include.children) {
    if (is_setting(*child)) remove(child->name);
  }
  for (const auto& child : include.children) {
    if (is_setting(*child) || child->name == "plugin") {
      copy->children.push_back(child->clone());
    } else if (child->name == "sensor") {
      Element* link = copy->child("link");
      if (!link) child->fail("the included model has no link of its own that could carry a sensor");
      link->children.push_back(child->clone());
    }
  }
  for (const Element* params : include.all(kParams))
    apply_params(*params, *copy, "include", context_.findings);
  return read_model(*copy, version);
}

namespace {

// The changes of an <include> in the model itself, beyond its pose.
bool is_override(const Element& child) {
  return is_setting(child) || child.name == "plugin" || child.name == "sensor" ||
         child.name == kParams;
}

// Also false if <static> alone is given, with the value that the model has: nothing has to be read
// again.
bool changes_model(const Element& include, const Model& model) {
  return std::any_of(include.children.begin(), include.children.end(), [&](const auto& child) {
    return is_override(*child) &&
           (child->name != "static" || include.boolean("static", false) != model.is_static);
  });
}

// Equal for equal overrides (those of a fleet), which share one model.
std::string override_key(const std::string& path, const Element& include) {
  std::string key = path;
  for (const auto& child : include.children) {
    if (child->name == "static")
      key += "\nstatic " + child->text;
    else if (is_override(*child))
      key += "\n" + child->source.str();
  }
  return key;
}

void report_not_found(const Element& element, const std::string& uri, const std::string& where,
                      ReadContext& context) {
  if (uri.rfind("https://fuel.", 0) == 0 || uri.rfind("http://fuel.", 0) == 0) {
    context.findings.error(element.source,
                           where + " " + uri,  // one text, so that all are reported as one list
                           "models of Fuel are not on this machine; the world runs without them. "
                           "`gz fuel download -u URI` fetches each");
    return;
  }
  context.findings.error(element.source, where,
                         "'" + uri + "' " + context.resources.why_not(uri, element.source.file) +
                             "; the world runs without it");
}

// The model, placed by <pose> and <placement_frame> of the <include>.
std::shared_ptr<const ScopedModel> placed_by(const Element& include,
                                             std::shared_ptr<const ScopedModel> model) {
  if (!include.has("pose") && !include.has("placement_frame")) return model;
  auto placed = std::make_shared<ScopedModel>(*model);
  if (include.has("pose")) {
    placed->pose = include.pose("pose");
    placed->relative_to = relative_to(include);
  }
  placed->placement_frame = include.string("placement_frame", model->placement_frame);
  if (include.has("placement_frame") && !include.has("pose"))
    include.child("placement_frame")->fail("needs a <pose> beside it");
  return placed;
}

}  // namespace

std::optional<SdfReader::Included> SdfReader::include(const Element& element,
                                                      const std::string& where) {
  report_other_children(
      element,
      {"uri", "name", "pose", "static", "enable_wind", "allow_auto_disable", "placement_frame",
       "plugin", "sensor", kParams, "ruedo:drive", "ruedo:joints", "ruedo:odometry", "ruedo:path",
       "ruedo:belt", "ruedo:door"},
      {}, where, context_.findings);
  const Element* uri = element.child("uri");
  if (!uri || uri->text.empty()) element.fail("has no <uri>");
  const auto path = context_.resources.find_model(uri->text, element.source.file);
  if (!path) {
    report_not_found(element, uri->text, where, context_);
    return std::nullopt;
  }
  Included result = read_file(*path, element);
  if (result.model && changes_model(element, *result.model->model)) {
    enter(*path, element);
    const std::string key = override_key(*path, element);
    if (const auto known = cache_.find(key); known != cache_.end()) {
      result = known->second;
    } else {
      result.model = read_overridden(*result.document->child("model"), element, result.version);
      cache_[key] = result;
    }
    leave();
  }
  if (const Element* name = element.child("name")) {
    if (name->text.empty()) name->fail("is empty");
    result.name = name->text;
    if (result.name == "world") {
      result.name = kModelNamedWorld;
      context_.findings.repaired(
          name->source, where,
          "'world' is a reserved name; the model is called '" + result.name + "'");
    }
  }
  if (result.model) result.model = placed_by(element, std::move(result.model));
  return result;
}

}  // namespace ruedo::world
