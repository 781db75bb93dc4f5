// The models that can be added to a world: Ruedo's own, and those in the `models` folders beside
// the world's file. Served as a list, and each as a scene of its own for a picture.
#pragma once

#include <list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "console/scene_data.h"
#include "world/model_library.h"

namespace ruedo::console {

class Library {
 public:
  static constexpr size_t kKept = 8;  // scenes that are kept in memory

  explicit Library(std::string world_file) : world_file_(std::move(world_file)) {}

  // [{"name": "desk", "robot": false}, ...]: names that SPAWN takes.
  std::string list();
  // Null for a number that is not in the list, or a model that cannot be read.
  const SceneData* scene(size_t index);

 private:
  const std::vector<world::ListedModel>& entries();

  std::string world_file_;
  std::vector<world::ListedModel> entries_;
  bool listed_ = false;
  std::list<std::pair<size_t, std::unique_ptr<SceneData>>> scenes_;  // most recently used first
};

}  // namespace ruedo::console
