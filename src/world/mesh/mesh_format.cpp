// The mesh's binary form: little endian, sections in a fixed order, each with its count first.
#include "world/mesh/mesh_format.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <stdexcept>

namespace ruedo::world {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the mesh cache is written as memory has it");

constexpr uint32_t kMagic = 0x6d647552;  // "Rudm"

class Writer {
 public:
  template <class T>
  void value(const T& v) {
    bytes_.append(reinterpret_cast<const char*>(&v), sizeof(T));
  }
  void string(std::string_view text) {
    value(static_cast<uint32_t>(text.size()));
    bytes_.append(text);
  }
  template <class T>
  void array(const std::vector<T>& items) {
    value(static_cast<uint32_t>(items.size()));
    if (!items.empty())
      bytes_.append(reinterpret_cast<const char*>(items.data()), items.size() * sizeof(T));
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T value() {
    T v;
    std::memcpy(&v, take(sizeof(T)), sizeof(T));
    return v;
  }
  std::string string(size_t longest = 4096) {
    const uint32_t size = value<uint32_t>();
    if (size > longest) throw std::runtime_error("a text of " + std::to_string(size) + " bytes");
    return {take(size), size};
  }
  uint32_t count(uint32_t most, const char* what) {
    const uint32_t n = value<uint32_t>();
    if (n > most)
      throw std::runtime_error(std::to_string(n) + " " + what + "; allowed are " +
                               std::to_string(most));
    return n;
  }
  template <class T>
  std::vector<T> array(uint32_t most, const char* what) {
    const uint32_t n = count(most, what);
    const char* from = take(n * sizeof(T));
    std::vector<T> items(n);
    if (n) std::memcpy(static_cast<void*>(items.data()), from, n * sizeof(T));
    return items;
  }
  bool done() const { return at_ == bytes_.size(); }

 private:
  const char* take(size_t n) {
    if (n > bytes_.size() - at_) throw std::runtime_error("it ends too early");
    const char* from = bytes_.data() + at_;
    at_ += n;
    return from;
  }
  std::string_view bytes_;
  size_t at_ = 0;
};

uint64_t mixed(uint64_t h) {
  h ^= h >> 33;
  h *= 0xff51afd7ed558ccdull;
  h ^= h >> 33;
  h *= 0xc4ceb9fe1a85ec53ull;
  return h ^ (h >> 33);
}

// Hashes eight bytes at a time, mixing each word in with a multiplication and a rotation.
uint64_t hashed(std::string_view bytes, uint64_t seed, uint64_t factor) {
  uint64_t h = seed ^ (bytes.size() * factor);
  size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    uint64_t word;
    std::memcpy(&word, bytes.data() + i, 8);
    h = std::rotl(h ^ mixed(word * factor), 27) * 5 + 0x52dce729;
  }
  uint64_t tail = 0;
  std::memcpy(&tail, bytes.data() + i, bytes.size() - i);
  return mixed(h ^ mixed(tail * factor));
}

}  // namespace

uint64_t content_hash(std::string_view bytes) {
  const uint64_t h = hashed(bytes, 0x9e3779b97f4a7c15ull, 0x87c37b91114253d5ull);
  return h ? h : 1;  // 0 is reserved for "does not exist"
}

std::string content_key(std::string_view bytes) {
  const uint64_t halves[2] = {content_hash(bytes),
                              hashed(bytes, 0xd6e8feb86659fd93ull, 0x4cf5ad432745937full)};
  std::string key;
  for (const uint64_t half : halves) {
    for (int shift = 60; shift >= 0; shift -= 4) key += "0123456789abcdef"[(half >> shift) & 15];
  }
  return key;
}

std::string pack_mesh(const MeshPackage& package) {
  const Mesh& mesh = package.mesh;
  Writer out;
  out.value(kMagic);
  out.value(kMeshFormatVersion);
  out.value(static_cast<uint32_t>(package.dependencies.size()));
  for (const auto& each : package.dependencies) {
    out.string(each.path);
    out.value(each.hash);
  }
  out.array(mesh.positions);
  out.array(mesh.normals);
  out.array(mesh.uvs);
  out.array(mesh.triangles);
  out.value(static_cast<uint32_t>(mesh.parts.size()));
  for (const auto& part : mesh.parts) {
    out.string(part.name);
    out.value(part.first_triangle);
    out.value(part.triangle_count);
    out.value(static_cast<int32_t>(part.material));
  }
  out.value(static_cast<uint32_t>(mesh.materials.size()));
  for (const auto& m : mesh.materials) {
    for (const Rgba* colour : {&m.ambient, &m.diffuse, &m.specular, &m.emissive})
      out.value(*colour);
    out.value(m.shininess);
    out.value(static_cast<uint8_t>(m.double_sided));
    out.string(m.texture ? m.texture->path : "");
    out.array(m.texture ? m.texture->embedded : std::vector<uint8_t>{});
  }
  out.value(static_cast<uint8_t>(mesh.closed));
  std::string bytes = out.take();
  const uint64_t check = content_hash(bytes);
  bytes.append(reinterpret_cast<const char*>(&check), sizeof check);
  return bytes;
}

std::string pack_solid(const Mesh& mesh) {
  MeshPackage solid;
  solid.mesh.positions = mesh.positions;
  solid.mesh.triangles = mesh.triangles;
  return pack_mesh(solid);
}

MeshPackage unpack_mesh(std::string_view bytes) {
  uint64_t check;
  if (bytes.size() < sizeof check) throw std::runtime_error("it ends too early");
  std::memcpy(&check, bytes.data() + bytes.size() - sizeof check, sizeof check);
  bytes.remove_suffix(sizeof check);
  if (check != content_hash(bytes)) throw std::runtime_error("its check sum is wrong");

  Reader in(bytes);
  if (in.value<uint32_t>() != kMagic) throw std::runtime_error("it is not a mesh");
  if (in.value<uint32_t>() != kMeshFormatVersion)
    throw std::runtime_error("it is of another version");
  MeshPackage package;
  package.dependencies.resize(in.count(1000, "files"));
  for (auto& each : package.dependencies) {
    each.path = in.string();
    each.hash = in.value<uint64_t>();
  }
  Mesh& mesh = package.mesh;
  mesh.positions = in.array<Eigen::Vector3f>(MeshLimits::kVertices, "vertices");
  mesh.normals = in.array<Eigen::Vector3f>(MeshLimits::kVertices, "normals");
  mesh.uvs = in.array<Eigen::Vector2f>(MeshLimits::kVertices, "texture coordinates");
  mesh.triangles = in.array<std::array<uint32_t, 3>>(MeshLimits::kTriangles, "triangles");
  mesh.parts.resize(in.count(MeshLimits::kParts, "parts"));
  for (auto& part : mesh.parts) {
    part.name = in.string();
    part.first_triangle = in.value<uint32_t>();
    part.triangle_count = in.value<uint32_t>();
    part.material = MaterialIndex(in.value<int32_t>());
  }
  mesh.materials.resize(in.count(MeshLimits::kParts, "materials"));
  for (auto& m : mesh.materials) {
    for (Rgba* colour : {&m.ambient, &m.diffuse, &m.specular, &m.emissive})
      *colour = in.value<Rgba>();
    m.shininess = in.value<float>();
    m.double_sided = in.value<uint8_t>() != 0;
    Texture texture;
    texture.path = in.string();
    texture.embedded = in.array<uint8_t>(MeshLimits::kTextureBytes, "bytes of a texture");
    if (!texture.path.empty() || !texture.embedded.empty())
      m.texture = std::make_shared<Texture>(std::move(texture));
  }
  mesh.closed = in.value<uint8_t>() != 0;
  if (!in.done()) throw std::runtime_error("there are bytes after its end");
  if (const std::string fault = mesh_fault(mesh); !fault.empty()) throw std::runtime_error(fault);
  return package;
}

std::string mesh_fault(const Mesh& mesh) {
  const size_t vertices = mesh.positions.size();
  if (mesh.triangles.empty()) return "it has no triangles";
  if (vertices > MeshLimits::kVertices)
    return "it has more than " + std::to_string(MeshLimits::kVertices) + " vertices";
  if (mesh.triangles.size() > MeshLimits::kTriangles) {
    return "it has more than " + std::to_string(MeshLimits::kTriangles) + " triangles";
  }
  if (!mesh.normals.empty() && mesh.normals.size() != vertices)
    return "it has not one normal per vertex";
  if (!mesh.uvs.empty() && mesh.uvs.size() != vertices)
    return "it has not one texture coordinate per vertex";
  for (const auto& p : mesh.positions) {
    if (!p.allFinite()) return "it has a vertex that is not finite";
    if (p.cwiseAbs().maxCoeff() > MeshLimits::kExtent_m) return "it reaches beyond 1000 km";
  }
  for (const auto& n : mesh.normals) {
    if (!n.allFinite()) return "it has a normal that is not finite";
  }
  for (const auto& uv : mesh.uvs) {
    if (!uv.allFinite()) return "it has a texture coordinate that is not finite";
  }
  for (const auto& t : mesh.triangles) {
    if (t[0] >= vertices || t[1] >= vertices || t[2] >= vertices)
      return "a triangle names a vertex that is not there";
  }
  for (const auto& part : mesh.parts) {
    if (part.first_triangle > mesh.triangles.size() ||
        part.triangle_count > mesh.triangles.size() - part.first_triangle) {
      return "a part names triangles that are not there";
    }
    if (part.material != MaterialIndex() && !mesh.materials.has(part.material)) {
      return "a part names a material that is not there";
    }
  }
  for (const auto& m : mesh.materials) {
    for (const Rgba* colour : {&m.ambient, &m.diffuse, &m.specular, &m.emissive}) {
      for (const float c : *colour) {
        if (!std::isfinite(c)) return "a colour is not finite";
      }
    }
    if (!std::isfinite(m.shininess)) return "a colour is not finite";
  }
  return "";
}

bool is_closed(const Mesh& mesh) {
  const size_t n = mesh.positions.size();
  if (mesh.triangles.size() < 4) return false;
  // Gives equal positions the same number.
  std::vector<uint32_t> order(n), point(n);
  std::iota(order.begin(), order.end(), 0u);
  const auto less = [&](uint32_t a, uint32_t b) {
    const auto &p = mesh.positions[a], &q = mesh.positions[b];
    return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
  };
  std::sort(order.begin(), order.end(), less);
  uint32_t last = 0;
  for (size_t i = 0; i < n; ++i) {
    if (i > 0 && less(order[i - 1], order[i])) last = static_cast<uint32_t>(i);
    point[order[i]] = last;
  }
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  edges.reserve(mesh.triangles.size() * 3);
  for (const auto& t : mesh.triangles) {
    const uint32_t p[3] = {point[t[0]], point[t[1]], point[t[2]]};
    if (p[0] == p[1] || p[1] == p[2] || p[2] == p[0]) continue;  // degenerate: no area, no edges
    for (int k = 0; k < 3; ++k) edges.emplace_back(p[k], p[(k + 1) % 3]);
  }
  if (edges.empty()) return false;
  std::sort(edges.begin(), edges.end());
  for (size_t i = 0; i < edges.size(); ++i) {
    if (i > 0 && edges[i] == edges[i - 1]) return false;
    if (!std::binary_search(edges.begin(), edges.end(), std::pair(edges[i].second, edges[i].first)))
      return false;
  }
  return true;
}

}  // namespace ruedo::world
