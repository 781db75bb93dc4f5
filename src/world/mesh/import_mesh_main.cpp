// ruedo-import-mesh INPUT: converts a mesh file to Ruedo's binary form, with assimp, on stdout.
// ruedo-import-mesh --pieces MOST: divides the mesh on stdin, in that form, into convex pieces.
//
// Runs as a child of the server, under the server's limits on memory and time and in a sandbox of
// its own: some malformed files make assimp abort or hang, and others may do worse. Exit code 0:
// the output is complete; otherwise the first line on stderr says why.
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <stdexcept>

#include <assimp/BaseImporter.h>
#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/input_file.h"
#include "system/file_handle.h"
#include "system/sandbox.h"
#include "world/convex/convex_pieces.h"
#include "world/document/document.h"
#include "world/mesh/mesh_format.h"

namespace fs = std::filesystem;
using namespace ruedo::world;

#ifdef __SANITIZE_ADDRESS__
// The search for leaks reads /proc, which the sandbox denies.
extern "C" int __lsan_is_turned_off() { return 1; }  // NOLINT(bugprone-reserved-identifier)
#endif

namespace {

// Opens files only in the mesh's folder and below, and records each, so that the cache knows what
// the result depends on.
class NotingFiles : public Assimp::DefaultIOSystem {
 public:
  explicit NotingFiles(const fs::path& mesh) : mesh_(mesh), folder_(mesh.parent_path()) {}

  bool Exists(const char* path) const override {
    const auto inside = relative(path);
    if (!inside) return false;
    const bool there = Assimp::DefaultIOSystem::Exists(path);
    note(*inside, there);
    return there;
  }
  Assimp::IOStream* Open(const char* path, const char* mode) override {
    const auto inside = relative(path);
    if (!inside || std::strchr(mode, 'w') || std::strchr(mode, 'a')) return nullptr;
    note(*inside, Assimp::DefaultIOSystem::Exists(path));
    if (folder_ / *inside == mesh_ && (mesh_.extension() == ".dae" || mesh_.extension() == ".DAE"))
      return without_leading_blanks();
    return Assimp::DefaultIOSystem::Open(path, mode);
  }
  std::vector<MeshDependency> dependencies() const {
    std::vector<MeshDependency> list;
    for (const auto& [path, hash] : seen_) list.push_back({path, hash});
    return list;
  }

 private:
  // assimp does not recognise a colour with a space before its first number (" 0.3 0.3 0.3 1"), and
  // refuses the file.
  Assimp::IOStream* without_leading_blanks() const {
    const std::string text = ruedo::read_input(mesh_.string(), MeshLimits::kFileBytes);
    auto* kept = new uint8_t[text.size() + 1];  // the stream owns it
    size_t size = 0;
    for (size_t i = 0; i < text.size();) {
      kept[size++] = static_cast<uint8_t>(text[i++]);
      if (kept[size - 1] != '>') continue;
      const size_t number = text.find_first_not_of(" \t\r\n", i);
      if (number != std::string::npos && std::strchr("+-.0123456789", text[number])) i = number;
    }
    return new Assimp::MemoryIOStream(kept, size, true);
  }
  std::optional<std::string> relative(const char* path) const {
    const fs::path full =
        fs::weakly_canonical(fs::path(path).is_absolute() ? fs::path(path) : folder_ / path);
    const fs::path inside = full.lexically_relative(folder_);
    if (inside.empty() || *inside.begin() == "..") return std::nullopt;
    return inside.string();
  }
  void note(const std::string& inside, bool there) const {
    if (folder_ / inside == mesh_ || seen_.count(inside) || seen_.size() >= 1000) return;
    uint64_t hash = 0;
    if (there)
      hash = content_hash(ruedo::read_input((folder_ / inside).string(), MeshLimits::kFileBytes));
    seen_[inside] = hash;
  }
  fs::path mesh_, folder_;
  mutable std::map<std::string, uint64_t> seen_;
};

Rgba rgba(const aiColor4D& c) { return {c.r, c.g, c.b, c.a}; }

Material material_of(const aiScene& scene, const aiMaterial& from) {
  Material to;
  aiColor4D colour;
  const auto read = [&](const char* key, unsigned type, unsigned index, Rgba& target) {
    if (from.Get(key, type, index, colour) == AI_SUCCESS) target = rgba(colour);
  };
  read(AI_MATKEY_COLOR_DIFFUSE, to.diffuse);
  read(AI_MATKEY_BASE_COLOR, to.diffuse);
  to.ambient = to.diffuse;
  read(AI_MATKEY_COLOR_SPECULAR, to.specular);
  read(AI_MATKEY_COLOR_EMISSIVE, to.emissive);
  float number = 0;
  if (from.Get(AI_MATKEY_SHININESS, number) == AI_SUCCESS && number > 0) to.shininess = number;
  if (from.Get(AI_MATKEY_OPACITY, number) == AI_SUCCESS && number >= 0 && number < 1)
    to.diffuse[3] = number;
  int two_sided = 0;
  if (from.Get(AI_MATKEY_TWOSIDED, two_sided) == AI_SUCCESS) to.double_sided = two_sided != 0;
  aiString path;
  if (from.GetTexture(aiTextureType_DIFFUSE, 0, &path) == AI_SUCCESS ||
      from.GetTexture(aiTextureType_BASE_COLOR, 0, &path) == AI_SUCCESS) {
    auto texture = std::make_shared<Texture>();
    if (const aiTexture* embedded = scene.GetEmbeddedTexture(path.C_Str())) {
      // mHeight 0: mWidth bytes of an encoded picture. Raw texels are dropped.
      if (embedded->mHeight == 0) {
        const auto* bytes = reinterpret_cast<const uint8_t*>(embedded->pcData);
        texture->embedded.assign(bytes, bytes + embedded->mWidth);
      }
    } else {
      texture->path = path.C_Str();
    }
    if (texture->path.size() > 4000) texture->path.clear();
    if (!texture->path.empty() || !texture->embedded.empty()) to.texture = texture;
    // Exporters leave the colour black when a texture gives it.
    if (to.texture && to.diffuse[0] + to.diffuse[1] + to.diffuse[2] == 0)
      to.diffuse = {1, 1, 1, to.diffuse[3]};
  }
  return to;
}

void append(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, Mesh& mesh,
            int depth) {
  if (depth > 200) throw std::runtime_error("its nodes are nested too deep");
  const aiMatrix4x4 X = parent * node.mTransformation;
  aiMatrix3x3 normal_matrix(X);
  const bool mirrored = normal_matrix.Determinant() < 0;
  normal_matrix.Inverse().Transpose();
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& from = *scene.mMeshes[node.mMeshes[m]];
    if (!(from.mPrimitiveTypes & aiPrimitiveType_TRIANGLE)) continue;
    const size_t first = mesh.positions.size();
    if (first + from.mNumVertices > MeshLimits::kVertices)
      throw std::runtime_error("it has more than 8000000 vertices");
    // One array for all parts: a part without normals or texture coordinates removes them from all
    // but the first.
    const bool with_normals = from.HasNormals(), with_uvs = from.HasTextureCoords(0);
    if (with_normals && mesh.normals.size() < first)
      mesh.normals.resize(first, Eigen::Vector3f::Zero());
    if (with_uvs && mesh.uvs.size() < first) mesh.uvs.resize(first, Eigen::Vector2f::Zero());
    for (unsigned v = 0; v < from.mNumVertices; ++v) {
      const aiVector3D p = X * from.mVertices[v];
      mesh.positions.emplace_back(p.x, p.y, p.z);
      if (with_normals) {
        aiVector3D n = normal_matrix * from.mNormals[v];
        n.NormalizeSafe();
        mesh.normals.emplace_back(n.x, n.y, n.z);
      }
      if (with_uvs) mesh.uvs.emplace_back(from.mTextureCoords[0][v].x, from.mTextureCoords[0][v].y);
    }
    if (!mesh.normals.empty()) mesh.normals.resize(mesh.positions.size(), Eigen::Vector3f::Zero());
    if (!mesh.uvs.empty()) mesh.uvs.resize(mesh.positions.size(), Eigen::Vector2f::Zero());
    Mesh::Part part;
    part.name = node.mName.length ? node.mName.C_Str() : from.mName.C_Str();
    if (part.name.size() > 4000) part.name.resize(4000);
    part.first_triangle = static_cast<uint32_t>(mesh.triangles.size());
    for (unsigned f = 0; f < from.mNumFaces; ++f) {
      const aiFace& face = from.mFaces[f];
      if (face.mNumIndices != 3) continue;
      std::array<uint32_t, 3> t;
      for (int k = 0; k < 3; ++k) t[k] = static_cast<uint32_t>(first + face.mIndices[k]);
      if (mirrored) std::swap(t[1], t[2]);
      mesh.triangles.push_back(t);
    }
    part.triangle_count = static_cast<uint32_t>(mesh.triangles.size()) - part.first_triangle;
    part.material = MaterialIndex(from.mMaterialIndex);
    if (part.triangle_count) mesh.parts.push_back(part);
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c)
    append(scene, *node.mChildren[c], X, mesh, depth + 1);
}

// Normals of zero length (from parts without normals beside parts that have them) are replaced by
// those of the triangles.
void fill_missing_normals(Mesh& mesh) {
  if (mesh.normals.empty()) return;
  for (const auto& t : mesh.triangles) {
    for (const uint32_t i : t) {
      if (i >= mesh.positions.size() || mesh.normals[i] != Eigen::Vector3f::Zero()) continue;
      const Eigen::Vector3f a = mesh.positions[t[1]] - mesh.positions[t[0]],
                            b = mesh.positions[t[2]] - mesh.positions[t[0]];
      const Eigen::Vector3f n = a.cross(b);
      mesh.normals[i] =
          n.squaredNorm() > 0 ? Eigen::Vector3f(n.normalized()) : Eigen::Vector3f::UnitZ();
    }
  }
}

// The transform that brings the scene to metres and z up. COLLADA's unit is in its root node; its
// up axis is ignored, as Gazebo does. glTF is y up by its specification. assimp turns 3DS to y up,
// and FBX from version 5.4 on, in the root node; before that, FBX is as its own settings say.
aiMatrix4x4 to_z_up(const aiScene& scene, const std::string& extension) {
  aiMatrix4x4 turn, scale;
  aiMatrix4x4::RotationX(static_cast<float>(M_PI / 2), turn);
  // Exact zeroes and ones: a quarter turn introduces no rounding.
  turn.b2 = turn.c3 = 0;
  turn.b3 = -1;
  turn.c2 = 1;
  if (extension == "gltf" || extension == "glb" || extension == "3ds") return turn;
  if (extension == "fbx") {
    float centimetres = 1.0f;  // centimetres per unit of the file
    int up = 1;
    if (scene.mMetaData) {
      double wide = 0;
      if (!scene.mMetaData->Get("UnitScaleFactor", centimetres) &&
          scene.mMetaData->Get("UnitScaleFactor", wide)) {
        centimetres = static_cast<float>(wide);
      }
      scene.mMetaData->Get("UpAxis", up);
    }
    aiMatrix4x4::Scaling(aiVector3D(centimetres / 100.0f), scale);
    return up == 1 || !scene.mRootNode->mTransformation.IsIdentity() ? turn * scale : scale;
  }
  return {};
}

MeshPackage imported(const fs::path& input) {
  std::string extension = input.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (!extension.empty()) extension.erase(0, 1);

  Assimp::Importer importer;
  // Only the importer for this file's extension: a file's bytes cannot select another.
  for (size_t i = importer.GetImporterCount(); i-- > 0;) {
    Assimp::BaseImporter* each = importer.GetImporter(i);
    std::set<std::string> extensions;
    each->GetExtensionList(extensions);
    if (!extensions.count(extension)) importer.UnregisterLoader(each);
  }
  auto* files = new NotingFiles(input);
  importer.SetIOHandler(files);  // the importer owns it
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, true);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_TANGENTS_AND_BITANGENTS | aiComponent_COLORS |
                                  aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                  aiComponent_LIGHTS | aiComponent_CAMERAS);
  const aiScene* scene = importer.ReadFile(
      input.string(), aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_RemoveComponent |
                          aiProcess_JoinIdenticalVertices);
  if (!scene || !scene->mRootNode) {
    const std::string why = importer.GetErrorString();
    if (why == std::bad_alloc().what()) throw std::bad_alloc();  // assimp caught it
    throw std::runtime_error(why);
  }

  MeshPackage package;
  append(*scene, *scene->mRootNode, to_z_up(*scene, extension), package.mesh, 0);
  for (unsigned m = 0; m < scene->mNumMaterials; ++m) {
    package.mesh.materials.push_back(material_of(*scene, *scene->mMaterials[m]));
  }
  if (const std::string fault = mesh_fault(package.mesh); !fault.empty())
    throw std::runtime_error(fault);
  fill_missing_normals(package.mesh);
  package.mesh.closed = is_closed(package.mesh);
  package.dependencies = files->dependencies();
  return package;
}

// A mesh with a part for each convex piece; one triangle and no parts if there is nothing to
// divide.
Mesh divided(const Mesh& mesh, size_t most) {
  std::vector<Eigen::Vector3d> positions;
  for (const auto& p : mesh.positions) positions.push_back(p.cast<double>());
  Mesh pieces;
  for (const ConvexPiece& piece : convex_pieces(positions, mesh.triangles, most)) {
    Mesh::Part part;
    const auto corner = static_cast<uint32_t>(pieces.positions.size());
    part.first_triangle = static_cast<uint32_t>(pieces.triangles.size());
    part.triangle_count = static_cast<uint32_t>(piece.triangles.size());
    for (const auto& p : piece.corners) pieces.positions.push_back(p.cast<float>());
    for (const auto& t : piece.triangles)
      pieces.triangles.push_back({corner + t[0], corner + t[1], corner + t[2]});
    pieces.parts.push_back(part);
  }
  if (pieces.parts.empty()) {
    pieces.positions = {mesh.positions[0]};
    pieces.triangles = {{0, 0, 0}};
  }
  return pieces;
}

std::string standard_input() {
  std::string text;
  std::array<char, 1 << 16> bytes;
  for (size_t n; (n = std::fread(bytes.data(), 1, bytes.size(), stdin)) > 0;)
    text.append(bytes.data(), n);
  return text;
}

void write(const MeshPackage& package, int output) {
  const std::string bytes = pack_mesh(package);
  if (ruedo::write_all(output, bytes.data(), bytes.size()) != bytes.size())
    throw std::runtime_error(std::string("the result cannot be written: ") + std::strerror(errno));
}

// The excess, the limit, and the remedy. Allocates nothing: the memory is used up.
void say_too_large(const char* path) {
  struct stat file{};
  if (*path != '\0') ::stat(path, &file);
  rlimit limit{};
  ::getrlimit(RLIMIT_AS, &limit);
  std::fprintf(stderr,
               "importing its %.1f MB needs more than the %.1f GiB of memory that an importer may "
               "use; reduce it to about 2 000 000 triangles, or split it into several files\n",
               static_cast<double>(file.st_size) * 1e-6,
               static_cast<double>(limit.rlim_cur) / (1 << 30));
}

}  // namespace

int main(int argc, char** argv) {
  const bool divides = argc == 3 && std::strcmp(argv[1], "--pieces") == 0;
  if (argc != 2 && !divides) {
    std::fprintf(stderr, "usage: ruedo-import-mesh INPUT > OUTPUT\n");
    return 2;
  }
  try {
    const ruedo::FileHandle output(::dup(STDOUT_FILENO));
    ::dup2(STDERR_FILENO, STDOUT_FILENO);  // output of libraries is not part of the mesh
    ruedo::Sandbox sandbox;
    sandbox.system = false;
    sandbox.alone = true;
    if (divides) {
      ruedo::enter(sandbox);
      const Mesh mesh = unpack_mesh(standard_input()).mesh;
      write({divided(mesh, std::stoul(argv[2])), {}}, output.get());
    } else {
      const fs::path mesh = fs::weakly_canonical(argv[1]);
      sandbox.readable = {mesh.parent_path().string()};
      ruedo::enter(sandbox);
      write(imported(mesh), output.get());
    }
    return 0;
  } catch (const std::bad_alloc&) {
    say_too_large(divides ? "" : argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
  }
  return 1;
}
