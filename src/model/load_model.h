// A model alone, for a world that runs already.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/load_budget.h"
#include "model/world_model.h"

namespace ruedo::model {

inline constexpr size_t kMostLinksOfSpawned = 1000;

struct LoadedModel {
  std::shared_ptr<const Model> model;
  std::string name;  // as the file says; a robot's is fit for channels
  std::vector<Finding> findings;
  std::vector<std::string> files_read;  // absolute paths: its own, meshes, pictures
};

// Of a file or by a name, SDF or URDF, from the folders that are searched for a world, and from
// nowhere else. Throws InputError, with file and line. budget: may be null; who gives one asks it
// for its fault afterwards.
LoadedModel load_model(const std::string& name, const std::string& world_file,
                       LoadBudget* budget = nullptr);

// Of a text. What it names is searched as if it stood in the world's folder; errors call it "the
// text".
LoadedModel load_model_text(const std::string& text, const std::string& world_file,
                            LoadBudget* budget = nullptr);

// Checks that the names of an instance and of its devices are fit for channels. Throws InputError.
void check_channel_names(const ModelInstance& instance, const Source& source);

// The file that load_model() would read. Throws InputError when there is none.
std::string model_file(const std::string& name, const std::string& world_file);

}  // namespace ruedo::model
