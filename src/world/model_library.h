// The models that can be added to a world by their names: Ruedo's own, and those in the `models`
// folders in and beside the folder of the world's file.
#pragma once

#include <string>
#include <vector>

namespace ruedo::world {

inline constexpr size_t kMostListedModels = 1000;

struct ListedModel {
  std::string name;  // as SPAWN takes it
  bool is_robot;     // of Ruedo's robots
};

// By folder and name, each name once. Reads the folders and each model.config, and no model.
std::vector<ListedModel> listed_models(const std::string& world_file);

}  // namespace ruedo::world
