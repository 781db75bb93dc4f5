// From a file or text to a world: reads SDF or URDF, then applies the command line's options.
#include "world/load.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "base/progress.h"
#include "base/text.h"
#include "ruedo/math.h"
#include "world/document/reserved_names.h"
#include "world/drives/drive.h"
#include "world/drives/holds.h"
#include "world/drives/lifts.h"
#include "world/drives/placement.h"
#include "world/edit/world_text.h"
#include "world/load_model.h"
#include "world/model/own_plugins.h"
#include "world/sdf/sdf_link.h"
#include "world/sdf/sdf_reader.h"
#include "world/settings.h"
#include "world/urdf/urdf.h"
#include "world/urdf/xacro.h"
#include "world/world_name.h"

namespace fs = std::filesystem;

namespace ruedo::world {
namespace {

class Loader {
 public:
  Loader(const std::string& path, const LoadOptions& options)
      : resources_(path, options.allow_absolute),
        textures_(findings_),
        meshes_(resources_, textures_),
        context_{findings_, resources_, documents_, meshes_, textures_, options.xacro_arguments},
        reader_(context_),
        path_(path) {}

  std::shared_ptr<const WorldModel> load(const Element& written, const LoadOptions& options) {
    const LoadsPlugins loads_plugins;
    findings_ = {};
    context_.triangles = {};
    context_.has_xacro = false;
    context_.controllers.begin();
    world_ = {};
    world_.file = path_;
    const std::shared_ptr<const Element> expanded =
        is_xacro(path_, &written) ? expand_xacro(path_, context_) : nullptr;
    const Element& root = expanded ? *expanded : written;
    reader_.enter(path_, root);
    if (root.name == "robot")
      read_robot(root);
    else
      read_sdf(root);
    reader_.leave();
    if (!options.spawns.empty()) {
      Room room(world_);
      for (const Spawn& spawn : options.spawns) place(spawn, room);
    }
    if (!options.xacro_arguments.empty() && !context_.has_xacro)
      throw InputError({}, "--xacro-arg " + options.xacro_arguments.front() +
                               ": no file of this world is xacro, which alone has arguments");
    world_.findings = findings_.list();  // what a robot that an option names may lack
    apply_drives(options.drives, world_);
    apply_settings(options.settings, world_);
    apply_disabled(options.disabled, world_);
    world_.faults.insert(world_.faults.end(), options.faults.begin(), options.faults.end());
    for (Fault& fault : world_.faults) name_robot(fault);
    name_stuck_robots(world_, findings_);
    check_holds(world_, findings_);
    check_lifts(world_, findings_);
    name_shared_paths(world_, findings_);
    if (const std::string fault = placed_triangles_fault(world_); !fault.empty())
      throw InputError({path_, 0}, fault);
    world_.findings = findings_.list();
    std::erase_if(world_.findings, [&](const Finding& finding) { return is_settled(finding); });
    for (const std::string& file : meshes_.files_read()) documents_.note(file);
    world_.files_read = documents_.files_read();
    return std::make_shared<const WorldModel>(std::move(world_));
  }

  DocumentStore& documents() { return documents_; }

 private:
  void name_robot(Fault& fault) const {
    std::vector<std::string> robots;
    for (const ModelInstance& instance : world_.models) {
      if (instance.is_robot()) robots.push_back(instance.name);
    }
    if (fault.robot.empty() && !robots.empty()) fault.robot = robots.front();
    if (std::find(robots.begin(), robots.end(), fault.robot) != robots.end()) return;
    std::string names;
    for (const std::string& robot : robots) names += (names.empty() ? "" : ", ") + robot;
    throw InputError(fault.source, "a fault of robot '" + fault.robot + "'; the world has " +
                                       (names.empty() ? "no robot" : names));
  }

  // The empty world in which a robot or model is loaded on its own.
  void read_empty_world() {
    const auto root = parse_document(kEmptyWorld, path_);
    reader_.read_world(*root->child("world"), {1, 9}, world_);
  }

  // The name of a file's robot, made usable in channel names.
  std::string name_in_world(const std::string& name, const std::shared_ptr<const Model>& model,
                            const Source& source) {
    const std::string fit =
        ModelInstance{name, {}, model}.is_robot() ? made_fit_for_channel(name) : name;
    if (fit != name)
      findings_.repaired(source, "model " + name,
                         "the name is not fit for a channel; the robot is called '" + fit + "'");
    return fit;
  }

  void add(const std::string& name, const Pose& X_WM, std::shared_ptr<const Model> model,
           const Source& source) {
    world_.models.push_back({name, X_WM, std::move(model)});
    check_channel_names(world_.models.back(), source);
  }

  void read_sdf(const Element& root) {
    const SdfVersion version = reader_.version_of(root);
    const auto worlds = root.all("world");
    if (!worlds.empty()) {
      for (const auto& child : root.children) {
        if (child.get() == worlds[0]) continue;
        const bool known = child->name == "world" || child->name == "model" ||
                           child->name == "light" || child->name == "actor";
        if (known)
          findings_.unsupported(child->source, "sdf",
                                child->name == "world"
                                    ? "a second world in one file is left out"
                                    : "<" + child->name + "> beside a <world> is left out");
      }
      reader_.read_world(*worlds[0], version, world_);
      return;
    }
    report_other_children(root, {"model", "light", "actor"}, {}, "sdf", findings_);
    read_empty_world();
    bool any = false, own_light = false;
    for (const auto& child : root.children) {
      if (child->name == "model") {
        if (const auto scope = reader_.read_model(*child, version)) {
          const std::string name =
              name_in_world(name_of_model(*child), scope->model, child->source);
          for (const ModelInstance& other : world_.models) {
            if (other.name == name && any) child->fail("a second model of the name '" + name + "'");
          }
          // The user's own ground plane replaces ours.
          std::erase_if(world_.models, [&](const auto& other) { return other.name == name; });
          if (!scope->relative_to.empty() && scope->relative_to != "world")
            findings_.error(
                child->source, "model " + name,
                "<pose> is relative to '" + scope->relative_to +
                    "', which is not a frame beside the model; it is relative to the world");
          add(name, scope->pose, scope->model, child->source);
        }
        any = true;
      } else if (child->name == "light") {
        if (!own_light) world_.lights.clear();  // it replaces our sun
        own_light = any = true;
        world_.lights.push_back(read_light(*child, child->pose("pose"), "light", context_));
      } else if (child->name == "actor") {
        any = true;
        Pose X_WM;
        auto model = SdfReader::actor_model(*child, X_WM, context_);
        add(required_name(*child), X_WM, std::move(model), child->source);
      }
    }
    if (!any) root.fail("holds no <world>, <model>, <light> or <actor>");
    if (!world_.models.empty()) world_.name = world_.models.back().name;
  }

  void read_robot(const Element& root) {
    const auto sdf = urdf_as_sdf(root, findings_);
    read_empty_world();
    const auto scope = reader_.read_model(*sdf, {1, 9});
    if (!scope) root.fail("the robot has no link");
    world_.name = name_in_world(scope->model->name, scope->model, root.source);
    add(world_.name, standing_on(world_, *scope->model, 0, 0, 0), scope->model, root.source);
  }

  void place(const Spawn& spawn, Room& room) {
    const std::string what = "--spawn " + spawn.model;
    const Element asker = [&] {
      Element e;
      e.name = what;
      return e;
    }();
    auto path = resources_.find_model(spawn.model, path_);
    if (!path && spawn.model.find("://") == std::string::npos) {
      const fs::path here = fs::absolute(spawn.model);
      std::error_code error;
      if (fs::exists(here, error))
        path = ResourceFinder::model_file(fs::weakly_canonical(here, error).string());
    }
    if (!path)
      throw InputError(
          {}, what + ": there is no such file, and no model of that name in the search path");
    std::shared_ptr<const Model> model;
    std::string name;
    const auto included = reader_.read_file(*path, asker);
    if (included.model) model = included.model->model, name = included.name;
    if (!model) throw InputError({*path, 0}, what + ": the file holds no model");
    const auto taken = [&](const std::string& wanted) {
      return std::any_of(world_.models.begin(), world_.models.end(),
                         [&](const auto& each) { return each.name == wanted; });
    };
    if (!spawn.name.empty()) {
      name = spawn.name;
      if (name == "ruedo" || is_reserved_name(name))
        throw InputError({}, what + ": the name '" + name + "' is reserved; choose another");
      if (taken(name))
        throw InputError({},
                         what + ": the name '" + name + "' is taken by another model of the world");
    } else {
      name = name_in_world(name, model, model->source);
      const std::string own = name;
      for (int number = 2; taken(name); ++number) name = own + "_" + std::to_string(number);
    }
    const Pose X_WM = room.standing_on(*model, spawn.x, spawn.y, spawn.yaw);
    if (const std::string other = room.overlapped(*model, X_WM); !other.empty()) {
      throw InputError({}, what + "@" + shown(spawn.x) + "," + shown(spawn.y) +
                               (spawn.yaw != 0 ? "," + shown(spawn.yaw) : "") +
                               ": there is no room, it would stand in '" + other + "'" +
                               nearest_place(*model, spawn, room));
    }
    add(name, X_WM, std::move(model), {});
    room.add(world_.models.back());
  }

  // A guessed drive, for a model that has got one from an <include> or --drive, or shall have none.
  bool is_settled(const Finding& finding) const {
    if (finding.text.rfind(kNoDriveIsWritten, 0) != 0) return false;
    return std::none_of(world_.models.begin(), world_.models.end(), [&](const ModelInstance& each) {
      const Model& model = *each.model;
      return model.source.str() == finding.source.str() && model.guess &&
             (!model.drive || model.drive->guessed);
    });
  }

  // Searches in rings around the requested place: "; the nearest free place is 1.5,2".
  static std::string nearest_place(const Model& model, const Spawn& spawn, const Room& room) {
    constexpr double kApart_m = 0.25;
    constexpr int kRings = 40, kAround = 16;
    for (int ring = 1; ring <= kRings; ++ring) {
      for (int i = 0; i < kAround; ++i) {
        const double angle = 2 * M_PI * i / kAround;
        const auto rounded = [](double value) { return std::round(value * 100) / 100; };
        const double x = rounded(spawn.x + ring * kApart_m * math::cos(angle)),
                     y = rounded(spawn.y + ring * kApart_m * math::sin(angle));
        if (room.overlapped(model, room.standing_on(model, x, y, spawn.yaw)).empty())
          return "; the nearest free place is " + shown(x) + "," + shown(y);
      }
    }
    return "";
  }

  Findings findings_;
  ResourceFinder resources_;
  DocumentStore documents_;
  TextureStore textures_;
  MeshLoader meshes_;
  ReadContext context_;
  SdfReader reader_;
  std::string path_;
  WorldModel world_;
};

}  // namespace

std::shared_ptr<const WorldModel> load_world(const std::string& name, const LoadOptions& options) {
  const std::string path = world_file(name);
  std::error_code error;
  fs::path full = fs::weakly_canonical(fs::absolute(path), error);
  if (error) full = fs::absolute(path);
  const Progress progress("loading " + path);
  Loader loader(full.string(), options);
  const auto root = loader.documents().read(full.string());
  return loader.load(*root, options);
}

class TextLoader::Impl {
 public:
  Impl(const std::string& path, LoadOptions options)
      : path_(absolute(path)), options_(std::move(options)) {}

  std::shared_ptr<const WorldModel> load(const std::string& text) {
    const std::shared_ptr<const Element> root = parse_document(text, path_);
    if (!loader_) loader_.emplace(path_, options_);
    try {
      loader_->documents().add(path_, root);
      return loader_->load(*root, options_);
    } catch (...) {  // it was left half read
      loader_.reset();
      throw;
    }
  }

 private:
  static std::string absolute(const std::string& path) {
    std::error_code error;
    return fs::weakly_canonical(fs::absolute(path), error).string();
  }

  std::string path_;
  LoadOptions options_;
  std::optional<Loader> loader_;
};

TextLoader::TextLoader(std::string path, LoadOptions options)
    : impl_(std::make_unique<Impl>(path, std::move(options))) {}
TextLoader::~TextLoader() = default;
std::shared_ptr<const WorldModel> TextLoader::load(const std::string& text) {
  return impl_->load(text);
}

std::shared_ptr<const WorldModel> load_world_text(const std::string& text, const std::string& path,
                                                  const LoadOptions& options) {
  return TextLoader(path, options).load(text);
}

}  // namespace ruedo::world
