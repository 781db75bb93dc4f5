// Folders are searched once; models are read when their pictures are requested.
#include "console/library.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "base/json.h"
#include "base/utf8.h"
#include "ruedo/errors.h"
#include "world/load_model.h"
#include "world/read/resources.h"

namespace fs = std::filesystem;

namespace ruedo::console {
namespace {

bool is_model(const fs::path& folder) {
  std::error_code error;
  return fs::is_regular_file(folder / "model.sdf", error) ||
         fs::is_regular_file(folder / "model.config", error);
}

// The subfolders that are models, by name.
std::set<std::string> models_in(const fs::path& folder) {
  std::set<std::string> names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with('.') && printable(name) == name && is_model(entry.path()) &&
        names.size() < Library::kMostModels)
      names.insert(name);
  }
  return names;
}

}  // namespace

const std::vector<Library::Entry>& Library::entries() {
  if (std::exchange(listed_, true)) return entries_;
  const fs::path shipped = world::shipped_worlds(), beside = fs::path(world_file_).parent_path();
  std::set<std::string> known{"sun", "ground_plane"};  // part of every world
  const auto add = [&](const fs::path& folder, bool robots) {
    for (const std::string& name : models_in(folder)) {
      if (entries_.size() < kMostModels && known.insert(name).second)
        entries_.push_back({name, robots});
    }
  };
  add(shipped / "robots", true);
  add(shipped / "models", false);
  add(beside / "models", false);
  add(beside / ".." / "models", false);
  return entries_;
}

std::string Library::list() {
  JsonWriter json;
  json.open('[');
  for (const Entry& entry : entries())
    json.open('{').member("name", entry.name).member("robot", entry.robot).close('}');
  return json.close(']').text();
}

const SceneData* Library::scene(size_t index) {
  if (index >= entries().size()) return nullptr;
  const auto kept = std::find_if(scenes_.begin(), scenes_.end(),
                                 [&](const auto& each) { return each.first == index; });
  if (kept != scenes_.end()) {
    scenes_.splice(scenes_.begin(), scenes_, kept);
    return scenes_.front().second.get();
  }
  try {
    const world::LoadedModel loaded = world::load_model(entries_[index].name, world_file_);
    world::WorldModel world;
    world.name = loaded.name;
    world.file = world_file_;
    auto still = std::make_shared<world::Model>(*loaded.model);  // its links at their start poses
    still->is_static = true;
    still->drive.reset();
    world.models.push_back({loaded.name, {}, std::move(still)});
    scenes_.emplace_front(index, std::make_unique<SceneData>(world, 0));
    if (scenes_.size() > kKept) scenes_.pop_back();
    return scenes_.front().second.get();
  } catch (const InputError&) {
    return nullptr;
  }
}

}  // namespace ruedo::console
