// Meshes from files: imported by a child process with limits on memory and time, cached on disk,
// read once per load.
//
// The child is ruedo-import-mesh. If a malformed file makes it hang, abort or run out of memory,
// the server continues without that mesh.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "world/document/load_budget.h"
#include "world/document/resources.h"
#include "world/mesh/texture_store.h"
#include "world/model/mesh.h"

namespace ruedo::world {

struct MeshPackage;

struct MeshImport {
  std::string importer;  // the program; empty: the one beside this program, or in the build folder
  std::string cache_folder;  // empty: $XDG_CACHE_HOME/ruedo or ~/.cache/ruedo
  bool cache = true;
  int wall_limit_s = 60;
  int cpu_limit_s = 30;
  size_t memory_limit_bytes = size_t{3} << 30;
  LoadBudget* budget = nullptr;  // for all meshes together; null: none
};

// The default cache folder; "" without one.
std::string mesh_cache_folder();

class MeshLoader {
 public:
  MeshLoader(const ResourceFinder& resources, TextureStore& textures, MeshImport import = {});

  // The mesh in a file, by absolute path. Throws std::runtime_error saying what is wrong with it,
  // and EnvironmentError where no mesh at all can be imported.
  std::shared_ptr<const Mesh> load(const std::string& path);

  // One submesh by name; if `center`, moved so that its bounding box is centred at the origin.
  std::shared_ptr<const Mesh> load_submesh(const std::string& path, const std::string& submesh,
                                           bool center);

  // At most `most` convex pieces of a mesh, a part each: what convex_pieces() gives; null for none.
  // Throws like load().
  std::shared_ptr<const Mesh> load_pieces(const std::shared_ptr<const Mesh>& mesh, size_t most);

  // Reports the pictures that the materials of a mesh's file name, and that are not there.
  void name_textures_not_found(const Mesh& mesh, Findings& findings) const;

  // The files read: meshes, files they refer to, and textures. Includes broken mesh files.
  const std::vector<std::string>& files_read() const { return files_; }

 private:
  struct Entry {
    std::shared_ptr<const Mesh> mesh;
    std::string fault;  // the reason of a missing mesh
    std::vector<std::string> textures_not_found = {};
  };
  std::shared_ptr<const Mesh> divided_or_cached(const Mesh& mesh, size_t most) const;
  Mesh import_or_cached(const std::string& path);
  Mesh taken(MeshPackage package, const std::string& path);

  const ResourceFinder& resources_;
  TextureStore& textures_;
  MeshImport import_;
  std::map<std::string, Entry> meshes_;
  struct Pieces {
    std::shared_ptr<const Mesh> mesh, pieces;  // kept, so that no other mesh is in its place
  };
  std::map<std::pair<const Mesh*, size_t>, Pieces> pieces_;  // only looked up, never iterated
  std::vector<std::string> files_;
};

}  // namespace ruedo::world
