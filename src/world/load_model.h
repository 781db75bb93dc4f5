// Loads a single model, for a world that is already running.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "world/document/load_budget.h"
#include "world/model/world_model.h"

namespace ruedo::world {

inline constexpr size_t kMostLinksOfSpawned = 1000;

struct LoadedModel {
  std::shared_ptr<const Model> model;
  std::string name;  // as in the file; a robot's name is usable in channel names
  std::vector<Finding> findings;
  std::vector<std::string> files_read;  // absolute paths: its own, meshes, pictures
};

// Loads a file or a name, SDF or URDF, from the folders that are searched for a world and from
// nowhere else. Throws InputError with file and line. budget: may be null; a caller that gives one
// asks it for its fault afterwards.
LoadedModel load_model(const std::string& name, const std::string& world_file,
                       LoadBudget* budget = nullptr);

// Loads a text. Its resources are searched as if it were in the world's folder; errors call it "the
// text".
LoadedModel load_model_text(const std::string& text, const std::string& world_file,
                            LoadBudget* budget = nullptr);

// Checks that the names of an instance and of its devices are usable in channel names. Throws
// InputError.
void check_channel_names(const ModelInstance& instance, const Source& source);

// The path that two models share, one of them as its name or a link's: "x/y" of the model x/y, and
// of the link y of x. "": none.
std::string shared_path(const ModelInstance& one, const ModelInstance& other);

// Reports models of a world that share a path: a request for it would be ambiguous.
void name_shared_paths(const WorldModel& world, Findings& findings);

// The file that load_model() would read. Throws InputError if it does not exist.
std::string model_file(const std::string& name, const std::string& world_file);

}  // namespace ruedo::world
