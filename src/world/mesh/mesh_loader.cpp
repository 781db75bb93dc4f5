// The cache of meshes and the child process that fills it.
#include "world/mesh/mesh_loader.h"

#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include <Eigen/Geometry>

#include "base/input_file.h"
#include "base/progress.h"
#include "system/child_process.h"
#include "system/file_handle.h"
#include "system/installation.h"
#include "world/document/document.h"
#include "world/mesh/mesh_format.h"

namespace fs = std::filesystem;

namespace ruedo::world {
namespace {

constexpr size_t kMostBytes = size_t{1} << 30;  // of a mesh, packed
// In the names of the cache's entries: what assimp makes of a file on another family of processors
// may differ in the last digits, and a home folder may be on both.
#ifdef __aarch64__
constexpr const char* kFamily = "-aarch64";
#else
constexpr const char* kFamily = "";
#endif

std::string default_importer() {
  if (const std::string installed = find_installed("bin/ruedo-import-mesh"); !installed.empty())
    return installed;
  return RUEDO_IMPORTER;
}

std::string first_line(const std::string& text) {
  std::string line = text.substr(0, std::min<size_t>(text.find('\n'), 300));
  for (char& c : line) {
    if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f)
      c = '?';  // may be bytes of the file
  }
  return line;
}

#ifdef __has_feature  // clang
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define __SANITIZE_ADDRESS__ 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kLimitAddressSpace = false;  // sanitizers reserve terabytes of addresses
#else
constexpr bool kLimitAddressSpace = true;
#endif

// The mesh that the importer gives for these arguments and that stdin, packed. Throws
// std::runtime_error for a mesh that cannot be imported, EnvironmentError where no mesh could be.
std::string imported(const MeshImport& import, std::vector<std::string> arguments,
                     std::string_view input = {}) {
  ProcessLimits limits;
  limits.cpu_s = static_cast<rlim_t>(import.cpu_limit_s);
  limits.output_bytes = kMostBytes;
  limits.memory_bytes = kLimitAddressSpace ? import.memory_limit_bytes : 0;
  limits.wall_s = import.wall_limit_s;
  bool out_of_budget = false;
  arguments.insert(arguments.begin(), import.importer);
  ProcessResult result = run_limited(
      std::move(arguments), limits,
      [&] { return out_of_budget = import.budget && import.budget->is_over(); }, input);
  if (!result.status) {
    if (out_of_budget) import.budget->take_time();
    throw std::runtime_error("the importer took longer than " +
                             std::to_string(import.wall_limit_s) + " s");
  }
  const int status = *result.status;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return std::move(result.output);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127) {
    throw EnvironmentError("the importer of meshes, " + import.importer + ", cannot be run");
  }
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU || signal == SIGKILL) {
      throw std::runtime_error("the importer needed more than " +
                               std::to_string(import.cpu_limit_s) + " s of CPU time");
    }
    throw std::runtime_error("the importer died of signal " + std::to_string(signal) +
                             "; the file is malformed");
  }
  const std::string message = first_line(result.messages);
  throw std::runtime_error(message.empty() ? "the importer failed" : message);
}

std::string bytes_of(const std::string& path, size_t most) {
  try {
    return read_input(path, most);
  } catch (const InputError& error) {
    throw std::runtime_error(error.message());
  }
}

size_t bytes_of(const Mesh& mesh) {
  const auto size = [](const auto& list) { return list.size() * sizeof(list[0]); };
  return size(mesh.positions) + size(mesh.normals) + size(mesh.uvs) + size(mesh.triangles);
}

bool dependencies_hold(const MeshPackage& package, const fs::path& folder) {
  return std::all_of(
      package.dependencies.begin(), package.dependencies.end(), [&](const MeshDependency& each) {
        std::error_code error;
        const fs::path path = folder / each.path;
        if (!fs::is_regular_file(path, error)) return each.hash == 0;
        try {
          return content_hash(read_input(path.string(), MeshLimits::kFileBytes)) == each.hash;
        } catch (const InputError&) {
          return false;
        }
      });
}

// Written into the cache by renaming, so that no other process reads half an entry. A cache that
// cannot be written is not an error.
void store(const std::string& folder, const std::string& name, const std::string& bytes) {
  std::error_code error;
  fs::create_directories(folder, error);
  std::string temporary = folder + "/new-XXXXXX";
  const FileHandle file(::mkstemp(temporary.data()));
  if (!file) return;
  if (write_all(file.get(), bytes.data(), bytes.size()) == bytes.size())
    fs::rename(temporary, folder + "/" + name, error);
  else
    error = std::make_error_code(std::errc::io_error);
  if (error) fs::remove(temporary, error);
}

}  // namespace

std::string mesh_cache_folder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache == '/')
    return std::string(cache) + "/ruedo";
  if (const char* home = std::getenv("HOME"); home && *home == '/')
    return std::string(home) + "/.cache/ruedo";
  return "";
}

namespace {

constexpr const char* kSubmesh = ", submesh ";  // in the name of a part of a file

}  // namespace

MeshLoader::MeshLoader(const ResourceFinder& resources, TextureStore& textures, MeshImport import)
    : resources_(resources), textures_(textures), import_(std::move(import)) {
  if (import_.importer.empty()) import_.importer = default_importer();
  if (import_.cache_folder.empty()) import_.cache_folder = mesh_cache_folder();
  if (import_.cache_folder.empty()) import_.cache = false;
}

Mesh MeshLoader::taken(MeshPackage package, const std::string& path) {
  for (const MeshDependency& each : package.dependencies) {
    std::error_code error;
    const fs::path file = fs::weakly_canonical(fs::path(path).parent_path() / each.path, error);
    if (fs::is_regular_file(file, error)) files_.push_back(file.string());
  }
  return std::move(package.mesh);
}

Mesh MeshLoader::import_or_cached(const std::string& path) {
  const fs::path file = path;
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  constexpr const char* kKnown[] = {".obj",  ".dae", ".stl", ".ply",
                                    ".gltf", ".glb", ".3ds", ".fbx"};
  if (std::find(std::begin(kKnown), std::end(kKnown), extension) == std::end(kKnown)) {
    std::error_code error;
    if (fs::is_directory(file, error)) throw std::runtime_error("it is a folder; a file is needed");
    throw std::runtime_error(
        (extension.empty() ? "a name without an extension" : "'" + extension + "'") +
        " is not a known kind of mesh; known are obj, dae, stl, ply, gltf, glb, 3ds, fbx");
  }
  const std::string content = bytes_of(path, MeshLimits::kFileBytes);
  files_.push_back(path);
  const std::string name = content_key(content) + extension.substr(1) + "-" +
                           std::to_string(kMeshFormatVersion) + kFamily + ".mesh";
  if (import_.cache) {
    const std::string entry = import_.cache_folder + "/" + name;
    std::error_code error;
    if (fs::is_regular_file(entry, error)) {
      try {
        MeshPackage package = unpack_mesh(bytes_of(entry, kMostBytes));
        if (dependencies_hold(package, file.parent_path())) return taken(std::move(package), path);
      } catch (const std::runtime_error&) {  // NOLINT(bugprone-empty-catch): imported again, below
      }
    }
  }
  const Progress progress("importing " + path);
  const std::string bytes = imported(import_, {path});
  MeshPackage package = unpack_mesh(bytes);
  if (import_.cache) store(import_.cache_folder, name, bytes);
  return taken(std::move(package), path);
}

std::shared_ptr<const Mesh> MeshLoader::divided_or_cached(const Mesh& mesh, size_t most) const {
  const std::string solid = pack_solid(mesh);
  const std::string name = content_key(solid) + "-" + std::to_string(most) + "-" +
                           std::to_string(kPiecesVersion) + kFamily + ".pieces";
  const auto taken = [](const std::string& bytes) -> std::shared_ptr<const Mesh> {
    auto pieces = std::make_shared<Mesh>(unpack_mesh(bytes).mesh);
    return pieces->parts.empty() ? nullptr : pieces;
  };
  if (import_.cache) {
    const std::string entry = import_.cache_folder + "/" + name;
    std::error_code error;
    if (fs::is_regular_file(entry, error)) {
      try {
        return taken(bytes_of(entry, kMostBytes));
      } catch (const std::runtime_error&) {  // NOLINT(bugprone-empty-catch): divided again, below
      }
    }
  }
  const Progress progress("dividing " + mesh.name);
  const std::string bytes = imported(import_, {"--pieces", std::to_string(most)}, solid);
  auto pieces = taken(bytes);
  if (import_.cache) store(import_.cache_folder, name, bytes);
  return pieces;
}

std::shared_ptr<const Mesh> MeshLoader::load_pieces(const std::shared_ptr<const Mesh>& mesh,
                                                    size_t most) {
  const auto [at, is_new] = pieces_.try_emplace({mesh.get(), most});
  if (is_new) {
    at->second.mesh = mesh;
    if (import_.budget) import_.budget->take_time();
    at->second.pieces = divided_or_cached(*mesh, most);
    if (import_.budget && at->second.pieces)
      import_.budget->take_mesh(bytes_of(*at->second.pieces));
  }
  return at->second.pieces;
}

std::shared_ptr<const Mesh> MeshLoader::load(const std::string& path) {
  const auto [at, is_new] = meshes_.try_emplace(path);
  Entry& entry = at->second;
  if (is_new) {
    try {
      if (import_.budget) import_.budget->take_time();
      auto mesh = std::make_shared<Mesh>(import_or_cached(path));
      if (import_.budget) import_.budget->take_mesh(bytes_of(*mesh));
      mesh->name = path;
      for (auto& material : mesh->materials) {
        if (!material.texture) continue;
        if (!material.texture->embedded.empty()) {
          material.texture = textures_.take(material.texture, path);
          continue;
        }
        const auto found = resources_.find_texture(material.texture->path, path);
        if (found)
          files_.push_back(*found);
        else
          entry.textures_not_found.push_back(material.texture->path);
        material.texture = found ? textures_.take(*found) : nullptr;
      }
      entry.mesh = std::move(mesh);
    } catch (const EnvironmentError&) {
      meshes_.erase(at);
      throw;
    } catch (const std::runtime_error& error) {
      entry.fault = error.what();
    }
  }
  if (!entry.mesh) throw std::runtime_error(entry.fault);
  return entry.mesh;
}

void MeshLoader::name_textures_not_found(const Mesh& mesh, Findings& findings) const {
  const auto file = meshes_.find(mesh.name.substr(0, mesh.name.find(kSubmesh)));
  if (file == meshes_.end()) return;
  for (const std::string& picture : file->second.textures_not_found)
    findings.unsupported(
        {file->first, 0}, "",
        "the texture '" + picture + "' is not found; the plain colour is shown instead");
}

std::shared_ptr<const Mesh> MeshLoader::load_submesh(const std::string& path,
                                                     const std::string& submesh, bool center) {
  const std::string key = path + "\n" + submesh + (center ? "\ncenter" : "");
  if (const auto known = meshes_.find(key); known != meshes_.end() && known->second.mesh)
    return known->second.mesh;
  const auto whole = load(path);
  auto mesh = std::make_shared<Mesh>();
  mesh->name = path + kSubmesh + submesh;
  std::vector<uint32_t> number(whole->positions.size(), UINT32_MAX);
  for (const auto& part : whole->parts) {
    if (part.name != submesh) continue;
    Mesh::Part copy = part;
    copy.first_triangle = static_cast<uint32_t>(mesh->triangles.size());
    for (uint32_t t = 0; t < part.triangle_count; ++t) {
      std::array<uint32_t, 3> triangle = whole->triangles[part.first_triangle + t];
      for (uint32_t& index : triangle) {
        if (number[index] == UINT32_MAX) {
          number[index] = static_cast<uint32_t>(mesh->positions.size());
          mesh->positions.push_back(whole->positions[index]);
          if (!whole->normals.empty()) mesh->normals.push_back(whole->normals[index]);
          if (!whole->uvs.empty()) mesh->uvs.push_back(whole->uvs[index]);
        }
        index = number[index];
      }
      mesh->triangles.push_back(triangle);
    }
    mesh->parts.push_back(copy);
  }
  if (mesh->triangles.empty()) {
    std::string names;
    for (const auto& part : whole->parts) names += (names.empty() ? "" : ", ") + part.name;
    throw std::runtime_error("it has no submesh '" + submesh + "'; there are " + names);
  }
  mesh->materials = whole->materials;
  if (center) {
    Eigen::AlignedBox3f box;
    for (const auto& p : mesh->positions) box.extend(p);
    for (auto& p : mesh->positions) p -= box.center();
  }
  mesh->closed = is_closed(*mesh);
  meshes_[key].mesh = mesh;
  return mesh;
}

}  // namespace ruedo::world
