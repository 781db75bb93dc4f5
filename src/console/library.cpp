// Models are listed once, and read when their pictures are requested.
#include "console/library.h"

#include <algorithm>
#include <utility>

#include "base/json.h"
#include "ruedo/errors.h"
#include "world/load_model.h"

namespace ruedo::console {

const std::vector<world::ListedModel>& Library::entries() {
  if (!std::exchange(listed_, true)) entries_ = world::listed_models(world_file_);
  return entries_;
}

std::string Library::list() {
  JsonWriter json;
  json.open('[');
  for (const world::ListedModel& entry : entries())
    json.open('{').member("name", entry.name).member("robot", entry.is_robot).close('}');
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
