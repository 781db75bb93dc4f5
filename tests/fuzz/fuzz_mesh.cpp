// Meshes. If the first byte is 0 to 7, the rest is a file of one of the known formats, for the
// importer in its child process; otherwise it is an entry of the cache, as the server unpacks it.
#include <stdexcept>

#include "ruedo/errors.h"
#include "scratch_file.h"
#include "world/mesh/mesh_format.h"
#include "world/mesh/mesh_loader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const ScratchFolder folder;
  constexpr const char* kKinds[] = {"obj", "dae", "stl", "ply", "gltf", "glb", "3ds", "fbx"};
  if (size < 1) return 0;
  try {
    if (data[0] < 8) {
      const std::string path =
          folder.write(std::string("mesh.") + kKinds[data[0]], data + 1, size - 1);
      const ruedo::world::ResourceFinder finder(path, false);
      ruedo::world::MeshImport import;
      import.cache = false;
      import.wall_limit_s = 5;
      import.cpu_limit_s = 2;
      ruedo::Findings findings;
      ruedo::world::TextureStore textures(findings);
      ruedo::world::MeshLoader(finder, textures, import).load(path);
    } else {
      ruedo::world::unpack_mesh({reinterpret_cast<const char*>(data + 1), size - 1});
    }
  } catch (const ruedo::EnvironmentError&) {
    throw;  // without an importer nothing is tried
  } catch (const std::runtime_error&) {
  }
  return 0;
}
