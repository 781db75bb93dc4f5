// Searches for files in a fixed order: around the naming file, around the top file, Ruedo's own
// worlds, then the environment variables of Ruedo and Gazebo.
#include "world/document/resources.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>

#include "base/input_file.h"
#include "system/installation.h"
#include "world/document/document.h"
#include "world/document/sdf_version.h"

namespace fs = std::filesystem;

namespace ruedo::world {
namespace {

constexpr int kFoldersAbove = 2;  // of a description that was copied without its package.xml

bool is_there(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

std::string full_path(const fs::path& path) {
  std::error_code error;
  fs::path result = fs::weakly_canonical(path, error);
  return error ? path.lexically_normal().string() : result.string();
}

void add_folder(std::vector<std::string>& folders, const fs::path& folder) {
  if (!is_folder(folder)) return;
  const std::string path = full_path(folder);
  if (std::find(folders.begin(), folders.end(), path) == folders.end()) folders.push_back(path);
}

// A file's folder, `models` in and beside it, and its parent folder, where neighbouring models lie.
void add_surroundings(std::vector<std::string>& folders, const fs::path& folder) {
  add_folder(folders, folder);
  add_folder(folders, folder / "models");
  add_folder(folders, folder / ".." / "models");
  if (folder.has_relative_path() && folder.parent_path().has_relative_path())
    add_folder(folders, folder / "..");
}

void add_variable(std::vector<std::string>& folders, const char* name) {
  const char* value = std::getenv(name);
  if (!value) return;
  std::string rest = value;
  while (!rest.empty()) {
    const size_t colon = rest.find(':');
    if (const std::string folder = rest.substr(0, colon); !folder.empty())
      add_folder(folders, folder);
    rest = colon == std::string::npos ? "" : rest.substr(colon + 1);
  }
}

// "Ground Plane" and "ground_plane" are the same name.
std::string plain_name(const std::string& name) {
  std::string plain;
  for (const unsigned char c : name) {
    if (c != ' ' && c != '_' && c != '-') plain += static_cast<char>(std::tolower(c));
  }
  return plain;
}

std::string decoded(const std::string& uri) {
  std::string text;
  for (size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size() &&
        std::isxdigit(static_cast<unsigned char>(uri[i + 1])) &&
        std::isxdigit(static_cast<unsigned char>(uri[i + 2]))) {
      text += static_cast<char>(std::stoi(uri.substr(i + 1, 2), nullptr, 16));
      i += 2;
    } else {
      text += uri[i];
    }
  }
  return text;
}

bool starts_with(const std::string& text, const char* prefix) { return text.rfind(prefix, 0) == 0; }

// A path without "." and "..", without leading and trailing slashes.
std::string tidy(const std::string& path) {
  std::string text = fs::path(path).lexically_normal().string();
  while (!text.empty() && text.front() == '/') text.erase(0, 1);
  while (!text.empty() && text.back() == '/') text.pop_back();
  return text;
}

// Fuel's cache holds a model's versions, each in a folder named by its number.
fs::path newest_version(const fs::path& model) {
  if (is_there(model / "model.config") || is_there(model / "model.sdf")) return model;
  int newest = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(model, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.empty() && name.size() < 7 &&
        name.find_first_not_of("0123456789") == std::string::npos)
      newest = std::max(newest, std::stoi(name));
  }
  return newest > 0 ? model / std::to_string(newest) : model;
}

// The name in a ROS package's manifest; "" without a readable one.
std::string package_name(const fs::path& folder) {
  const fs::path manifest = folder / "package.xml";
  if (!is_there(manifest)) return "";
  try {
    return parse_document(read_input(manifest.string(), 1 << 20), manifest.string())
        ->string("name", "");
  } catch (const InputError&) {
    return "";
  }
}

// The user's home, or above it: it may hold more than models.
bool holds_home(const fs::path& folder) {
  const char* home = std::getenv("HOME");
  return home && starts_with(full_path(home) + "/", (folder.string() + "/").c_str());
}

// The folder above a package's folder, where its own files lie.
bool may_be_package(const fs::path& folder) {
  return folder.parent_path().has_relative_path() && !holds_home(folder);
}

// The workspace folder that holds the packages beside the file's own; "": the file is in none.
std::string workspace_of(const std::string& file) {
  for (fs::path folder = fs::path(file).parent_path(); folder.has_relative_path();
       folder = folder.parent_path()) {
    if (is_there(folder / "package.xml")) return folder.parent_path().string();
  }
  return "";
}

}  // namespace

std::string shipped_worlds() {
  const std::string installed = find_installed("share/ruedo/worlds");
  if (is_folder(installed)) return full_path(installed);
  // A build within its source tree, which may be a copy, and one elsewhere.
  if (const std::string beside = find_installed("worlds/arena.sdf"); !beside.empty())
    return full_path(fs::path(beside).parent_path().string());
  const char* const worlds = RUEDO_SOURCE_TREE "/worlds";
  return is_folder(worlds) ? full_path(worlds) : "";
}

ResourceFinder::ResourceFinder(const std::string& top_file, bool allow_absolute)
    : allow_absolute_(allow_absolute) {
  add_surroundings(near_, fs::path(full_path(top_file)).parent_path());
  if (const std::string worlds = shipped_worlds(); !worlds.empty()) {
    add_folder(far_, worlds);
    add_folder(far_, fs::path(worlds) / "robots");
    add_folder(far_, fs::path(worlds) / "models");
  }
  for (const char* name :
       {"RUEDO_PATH", "GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH", "IGN_GAZEBO_RESOURCE_PATH",
        "GAZEBO_RESOURCE_PATH", "SDF_PATH", "ROS_PACKAGE_PATH"}) {
    add_variable(far_, name);
  }
  if (const char* prefixes = std::getenv("AMENT_PREFIX_PATH")) {
    std::string rest = prefixes;
    while (!rest.empty()) {
      const size_t colon = rest.find(':');
      add_folder(far_, fs::path(rest.substr(0, colon)) / "share");
      rest = colon == std::string::npos ? "" : rest.substr(colon + 1);
    }
  }
  if (const char* home = std::getenv("HOME")) {
    add_folder(far_, fs::path(home) / ".gazebo/models");
    for (const char* cache : {".gz/fuel/fuel.gazebosim.org", ".ignition/fuel/fuel.gazebosim.org",
                              ".ignition/fuel/fuel.ignitionrobotics.org"}) {
      std::vector<fs::path> owners;
      std::error_code error;
      for (const auto& entry : fs::directory_iterator(fs::path(home) / cache, error))
        owners.push_back(entry.path());
      std::sort(owners.begin(), owners.end());
      for (const fs::path& owner : owners) add_folder(far_, owner / "models");
    }
  }
}

std::vector<std::string> ResourceFinder::folders() const {
  std::vector<std::string> all = near_;
  all.insert(all.end(), far_.begin(), far_.end());
  return all;
}

std::vector<std::string> ResourceFinder::folders_of(const std::string& xacro) const {
  if (allow_absolute_) return {"/"};
  std::vector<std::string> found = roots_for(xacro);
  if (for_strangers_) return found;
  const fs::path own = fs::path(xacro).parent_path();
  std::erase_if(found, [&](const std::string& folder) {
    return folder != own && holds_home(folder) &&
           std::find(far_.begin(), far_.end(), folder) == far_.end();
  });
  int above = 0;
  for (fs::path folder = own.parent_path(); folder.has_relative_path();
       folder = folder.parent_path()) {
    if (++above <= kFoldersAbove && may_be_package(folder)) add_folder(found, folder);
  }
  for (fs::path folder = own; folder.has_relative_path(); folder = folder.parent_path()) {
    if (!is_there(folder / "package.xml")) continue;
    add_folder(found, folder);
    std::error_code error;
    for (const auto& beside : fs::directory_iterator(folder.parent_path(), error)) {
      if (is_there(beside.path() / "package.xml")) add_folder(found, beside.path());
    }
  }
  return found;
}

ResourceFinder ResourceFinder::for_strangers(const std::string& world_file) {
  ResourceFinder finder(world_file, false);
  finder.for_strangers_ = true;
  finder.near_.clear();
  const fs::path folder = fs::path(full_path(world_file)).parent_path();
  for (const fs::path& each : {folder, folder / "models", folder / ".." / "models"})
    add_folder(finder.near_, each);
  return finder;
}

bool ResourceFinder::reaches(const std::string& path) const {
  const std::string full = full_path(path);  // where links lead
  for (const auto* roots : {&near_, &far_}) {
    for (const std::string& root : *roots) {
      const std::string begin = root == "/" ? root : root + "/";
      if (full != root && !starts_with(full, begin.c_str())) continue;
      if (full == root || full.find("/.", begin.size() - 1) == std::string::npos) return true;
    }
  }
  return false;
}

std::vector<std::string> ResourceFinder::roots_for(const std::string& from) const {
  std::vector<std::string> roots;
  if (for_strangers_) {
    if (reaches(from)) add_folder(roots, fs::path(from).parent_path());
    for (const auto* folders : {&near_, &far_}) {
      for (const auto& each : *folders) add_folder(roots, each);
    }
    return roots;
  }
  add_surroundings(roots, fs::path(from).parent_path());
  for (const auto& each : near_) add_folder(roots, each);
  for (const auto& each : far_) add_folder(roots, each);
  return roots;
}

// Links are followed here: the user made them, not the world file.
bool ResourceFinder::allowed(const std::string& path, const std::string& from) const {
  for (const auto& root : roots_for(from)) {
    if (path == root || starts_with(path, (root + "/").c_str())) return true;
  }
  return false;
}

// A ROS package may lie in a folder of another name: one whose package.xml has the name counts too,
// whether above the naming file, beside its package, or in or below a search folder. Above the
// naming file, the folder's own name suffices.
std::optional<std::string> ResourceFinder::in_package(const std::string& package,
                                                      const std::string& rest,
                                                      const std::string& from) const {
  for (fs::path folder = fs::path(from).parent_path();
       !for_strangers_ && folder.has_relative_path(); folder = folder.parent_path()) {
    if (!is_there(folder / rest)) continue;
    if ((folder.filename() == package && may_be_package(folder)) || package_name(folder) == package)
      return full_path(folder / rest);
  }
  std::vector<std::string> roots = roots_for(from);
  if (const std::string beside = for_strangers_ ? "" : workspace_of(from); !beside.empty())
    add_folder(roots, beside);
  for (const auto& root : roots) {
    const auto [at, inserted] = packages_.try_emplace(root);
    if (inserted) {
      std::vector<fs::path> folders{root};
      std::error_code error;
      for (const auto& entry : fs::directory_iterator(root, error)) folders.push_back(entry.path());
      std::sort(folders.begin() + 1, folders.end());
      for (const auto& folder : folders) {
        if (const std::string name = package_name(folder); !name.empty())
          at->second.emplace(name, folder.string());
      }
    }
    const auto folder = at->second.find(package);
    if (folder != at->second.end() && is_there(fs::path(folder->second) / rest))
      return full_path(fs::path(folder->second) / rest);
  }
  return std::nullopt;
}

std::optional<std::string> ResourceFinder::find(const std::string& uri,
                                                const std::string& from) const {
  std::optional<std::string> found = find_anything(uri, from);
  if (found && for_strangers_ && !reaches(*found)) return std::nullopt;
  return found;
}

std::optional<std::string> ResourceFinder::find_anything(const std::string& written,
                                                         const std::string& from) const {
  const std::string uri = decoded(written);
  if (uri.empty() || uri.find('\0') != std::string::npos) return std::nullopt;
  if (starts_with(uri, "http://") || starts_with(uri, "https://")) return find_fuel(uri, from);
  for (const char* scheme : {"model://", "package://"}) {
    if (starts_with(uri, scheme))
      return find_by_name(tidy(uri.substr(std::string(scheme).size())), from);
  }
  if (starts_with(uri, "file://")) {
    const std::string path = uri.substr(7);
    if (const auto above = find_above(path, from)) return above;
    return find_path(path, from);
  }
  if (uri.find("://") != std::string::npos) return std::nullopt;
  return find_path(uri, from);
}

// A model fetched from Fuel: .../OWNER/models/NAME[/VERSION][/files/PATH]
std::optional<std::string> ResourceFinder::find_fuel(const std::string& uri,
                                                     const std::string& from) const {
  const size_t models = uri.find("/models/");
  if (models == std::string::npos) return std::nullopt;
  std::string name = uri.substr(models + 8), rest;
  if (const size_t files = name.find("/files/"); files != std::string::npos)
    rest = tidy(name.substr(files + 7));
  name = plain_name(name.substr(0, name.find('/')));
  if (name.empty() || starts_with(rest, "..")) return std::nullopt;
  for (const auto& root : roots_for(from)) {
    std::vector<std::string> matches;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(root, error)) {
      if (plain_name(entry.path().filename().string()) == name)
        matches.push_back((newest_version(entry.path()) / rest).string());
    }
    std::sort(matches.begin(), matches.end());
    for (const auto& match : matches) {
      if (is_there(match)) return full_path(match);
    }
  }
  return std::nullopt;
}

// model://PATH and package://PATH.
std::optional<std::string> ResourceFinder::find_by_name(const std::string& path,
                                                        const std::string& from) const {
  if (path.empty() || starts_with(path, "..")) return std::nullopt;
  if (const auto found = find_in_roots(path, from)) return found;
  const size_t slash = path.find('/');
  return in_package(path.substr(0, slash), slash == std::string::npos ? "" : path.substr(slash + 1),
                    from);
}

// "file://models/x/mesh.dae", named by a file below that `models` folder.
std::optional<std::string> ResourceFinder::find_above(const std::string& path,
                                                      const std::string& from) const {
  const std::string tidied = tidy(path);
  if (fs::path(path).is_absolute() || tidied.empty()) return std::nullopt;
  const fs::path top = *fs::path(tidied).begin();
  for (fs::path folder = fs::path(from).parent_path(); folder.has_relative_path() && top != "..";
       folder = folder.parent_path()) {
    if (folder.filename() == top && is_there(folder.parent_path() / tidied))
      return full_path(folder.parent_path() / tidied);
  }
  return std::nullopt;
}

// Beside the file that names it, or below a search folder.
std::optional<std::string> ResourceFinder::find_path(const std::string& path,
                                                     const std::string& from) const {
  const bool absolute = fs::path(path).is_absolute();
  const std::string beside =
      (absolute ? fs::path(path) : fs::path(from).parent_path() / path).lexically_normal().string();
  if (is_there(beside) && ((absolute && allow_absolute_) || allowed(beside, from)))
    return full_path(beside);
  if (absolute) return std::nullopt;
  const std::string tidied = tidy(path);
  if (tidied.empty() || starts_with(tidied, "..")) return std::nullopt;
  return find_in_roots(tidied, from);
}

std::optional<std::string> ResourceFinder::find_in_roots(const std::string& path,
                                                         const std::string& from) const {
  for (const auto& root : roots_for(from)) {
    const std::string found = full_path(fs::path(root) / path);
    if (is_there(found)) return found;
  }
  return std::nullopt;
}

// The deepest common folder.
static std::string folder_of_both(const fs::path& one, const std::string& other) {
  const fs::path two = fs::absolute(other).lexically_normal();
  fs::path both;
  for (auto a = one.begin(), b = two.begin(); a != one.end() && b != two.end() && *a == *b;
       ++a, ++b)
    both /= *a;
  return both.string();
}

std::string ResourceFinder::why_not(const std::string& uri, const std::string& from) const {
  const std::string path = decoded(starts_with(uri, "file://") ? uri.substr(7) : uri);
  if (for_strangers_ || path.empty() || path.find('\0') != std::string::npos ||
      path.find("://") != std::string::npos)
    return "is not found";
  const bool absolute = fs::path(path).is_absolute();
  const fs::path full =
      (absolute ? fs::path(path) : fs::path(from).parent_path() / path).lexically_normal();
  if (is_folder(full.string()) && allowed(full.string(), from))
    return "is a folder without model.config or model.sdf";
  if (!is_there(full) || allowed(full.string(), from)) return "is not found";
  return absolute ? "lies outside the folders that are searched (--allow-absolute lets it in)"
                  : "leads out of the folders that are searched (RUEDO_PATH=" +
                        folder_of_both(full, from) + " lets it in)";
}

std::optional<std::string> ResourceFinder::find_model(const std::string& uri,
                                                      const std::string& from) const {
  const auto [at, is_new] = models_.try_emplace(uri + "\n" + fs::path(from).parent_path().string());
  if (is_new) {
    const auto found = find(uri, from);
    at->second = found ? model_file(*found) : std::nullopt;
    if (at->second && for_strangers_ && !reaches(*at->second))
      at->second = std::nullopt;  // a link inside the model's folder
  }
  return at->second;
}

std::optional<std::string> ResourceFinder::model_file(const std::string& path) {
  if (!is_folder(path)) return path;
  const fs::path folder = path;
  const fs::path config = folder / "model.config";
  if (is_there(config)) {
    const auto root = parse_document(read_input(config.string(), 1 << 20), config.string());
    // The newest version that Ruedo reads; a version that cannot be parsed counts as the oldest.
    std::string best;
    SdfVersion best_version{0, 0};
    for (const Element* sdf : root->all("sdf")) {
      const std::string* written = sdf->attribute("version");
      const SdfVersion version =
          written ? SdfVersion::parse(*written).value_or(SdfVersion{0, 1}) : SdfVersion{0, 1};
      const std::string name = tidy(sdf->text);
      if (name.empty() || starts_with(name, "..") || !is_there(folder / name)) continue;
      if (best.empty() || best_version < version) {
        best = (folder / name).string();
        best_version = version;
      }
    }
    if (!best.empty()) return best;
  }
  if (is_there(folder / "model.sdf")) return (folder / "model.sdf").string();
  if (is_there(config))
    throw InputError({config.string(), 0}, "<sdf> names no file that is in the folder");
  return std::nullopt;
}

std::optional<std::string> ResourceFinder::find_texture(const std::string& name,
                                                        const std::string& from) const {
  if (auto found = find(name, from); found && !is_folder(*found)) return found;
  // Exporters write paths of their own machine; the picture then lies beside the mesh or in the
  // model's folders.
  std::string slashes = name;
  std::replace(slashes.begin(), slashes.end(), '\\', '/');
  const fs::path file = fs::path(slashes).filename();
  if (file.empty() || file == "..") return std::nullopt;
  const fs::path folder = fs::path(from).parent_path();
  for (const char* place : {".", "textures", "materials/textures", "../textures",
                            "../materials/textures", "../../materials/textures"}) {
    const fs::path candidate = folder / place / file;
    if (!may_read(candidate)) continue;
    if (is_there(candidate) && !is_folder(candidate)) return full_path(candidate);
  }
  return std::nullopt;
}

}  // namespace ruedo::world
