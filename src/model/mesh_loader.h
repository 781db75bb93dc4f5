// Meshes from files: imported by a child process with limits on memory and time, kept in a cache on
// disk, read once a load.
//
// The child is the program ruedo-import-mesh: a malformed file may hang it, abort it or eat its
// memory, and the server goes on without that mesh.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "model/load_budget.h"
#include "model/mesh.h"
#include "model/resources.h"

namespace ruedo::model {

struct MeshPackage;

struct MeshImport {
  std::string importer;      // the program; empty: beside this program, or where it was built
  std::string cache_folder;  // empty: $XDG_CACHE_HOME/ruedo or ~/.cache/ruedo
  bool cache = true;
  int wall_limit_s = 60;
  int cpu_limit_s = 30;
  size_t memory_limit_bytes = size_t{3} << 30;
  LoadBudget* budget = nullptr;  // of all meshes together; null: none
};

// Where imported meshes are kept unless an import says otherwise; "" when there is no such place.
std::string mesh_cache_folder();

class MeshLoader {
 public:
  explicit MeshLoader(const ResourceFinder& resources, MeshImport import = {});

  // The mesh of a file with an absolute path. Throws std::runtime_error that says what is wrong
  // with it.
  std::shared_ptr<const Mesh> load(const std::string& path);

  // One submesh by name, moved so that its bounding box is centred at the origin when `center`.
  std::shared_ptr<const Mesh> load_submesh(const std::string& path, const std::string& submesh,
                                           bool center);

  // What was read so far: meshes, what they name, and their textures. A mesh file that is broken,
  // too.
  const std::vector<std::string>& files_read() const { return files_; }

 private:
  struct Entry {
    std::shared_ptr<const Mesh> mesh;
    std::string fault;  // why there is none
  };
  Mesh import_or_cached(const std::string& path);
  Mesh taken(MeshPackage package, const std::string& path);

  const ResourceFinder& resources_;
  MeshImport import_;
  std::map<std::string, Entry> meshes_;
  std::vector<std::string> files_;
};

}  // namespace ruedo::model
