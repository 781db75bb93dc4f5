// One pass over the models for each question.
#include "engine/edits/world_editor.h"

#include <algorithm>
#include <charconv>
#include <set>
#include <utility>

#include "engine/edits/edits.h"
#include "ruedo/math.h"
#include "world/drives/placement.h"

namespace ruedo::engine {

WorldEditor::Placed WorldEditor::place(const std::string& name, const Pose& X_WM,
                                       std::shared_ptr<const world::Model> model) {
  IndexedVector<InstanceIndex, world::ModelInstance>& models = world_.models;
  const auto free =
      std::find_if(models.begin(), models.end(), [&](const world::ModelInstance& instance) {
        return instance.removed && instance.model == model;
      });
  if (free == models.end()) {
    const InstanceIndex instance = models.next();
    models.push_back({name, X_WM, std::move(model)});
    return {instance, false};
  }
  free->name = name;
  free->X_WM = X_WM;
  free->removed = false;
  return {InstanceIndex(free - models.begin()), true};
}

void WorldEditor::remove(InstanceIndex instance) {
  world::ModelInstance& removed = world_.models[instance];
  removed.removed = true;
  removed.name.clear();
}

InstanceIndex find_model(const world::WorldModel& world, const std::string& name) {
  const auto found = std::find_if(world.models.begin(), world.models.end(),
                                  [&](const world::ModelInstance& instance) {
                                    return !instance.removed && instance.name == name;
                                  });
  return found == world.models.end() ? InstanceIndex()
                                     : InstanceIndex(found - world.models.begin());
}

std::string unused_name(const world::WorldModel& world, const std::string& name) {
  if (!find_model(world, name).valid()) return name;
  const std::string stem = name + "_";
  std::set<int> taken;
  for (const world::ModelInstance& instance : world.models) {
    if (instance.removed || !instance.name.starts_with(stem)) continue;
    const char* const begin = instance.name.data() + stem.size();
    const char* const end = instance.name.data() + instance.name.size();
    int number = 0;
    if (const auto [last, error] = std::from_chars(begin, end, number);
        error == std::errc() && last == end && *begin != '0')
      taken.insert(number);
  }
  int number = 2;
  for (auto at = taken.lower_bound(2); at != taken.end() && *at == number; ++at) ++number;
  return stem + std::to_string(number);
}

Pose spawn_pose(const world::WorldModel& world, const world::Model& model,
                const spawn_request_t& request) {
  const double* q = request.orientation;
  const Pose X_WM{Quat(q[0], q[1], q[2], q[3]).normalized(),
                  Vec3(request.position[0], request.position[1], request.position[2])};
  if (!request.on_ground) return X_WM;
  const Vec3 ahead = X_WM.rotation * Vec3::UnitX();
  return world::standing_on(world, model, request.position[0], request.position[1],
                            math::atan2(ahead.y(), ahead.x()), request.position[2]);
}

}  // namespace ruedo::engine
