#include "world/model_library.h"

#include <filesystem>
#include <set>

#include "base/utf8.h"
#include "world/document/resources.h"

namespace fs = std::filesystem;

namespace ruedo::world {
namespace {

// Not a folder of meshes that other models share, though it has a model.config.
bool is_model(const fs::path& folder) {
  std::error_code error;
  try {
    return fs::is_directory(folder, error) && ResourceFinder::model_file(folder.string());
  } catch (const InputError&) {
    return false;
  }
}

// The subfolders that are models, by name.
std::set<std::string> models_in(const fs::path& folder) {
  std::set<std::string> names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with('.') && printable(name) == name && is_model(entry.path()) &&
        names.size() < kMostListedModels)
      names.insert(name);
  }
  return names;
}

}  // namespace

std::vector<ListedModel> listed_models(const std::string& world_file) {
  const fs::path shipped = shipped_worlds(), beside = fs::path(world_file).parent_path();
  std::vector<ListedModel> models;
  std::set<std::string> known{"sun", "ground_plane"};  // part of every world
  const auto add = [&](const fs::path& folder, bool robots) {
    for (const std::string& name : models_in(folder)) {
      if (models.size() < kMostListedModels && known.insert(name).second)
        models.push_back({name, robots});
    }
  };
  add(shipped / "robots", true);
  add(shipped / "models", false);
  add(beside / "models", false);
  add(beside / ".." / "models", false);
  return models;
}

}  // namespace ruedo::world
