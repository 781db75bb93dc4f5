#include "scene/pictures/render_mesh.h"

#include <algorithm>
#include <cmath>

#include "ruedo/math.h"
#include "world/model/height_grid.h"

namespace ruedo::scene {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

// Maximum triangles of a piece of a mesh file: small enough for culling to pay off, large enough
// that draw calls do not cost more than it saves.
constexpr uint32_t kPieceTriangles = 4000;

void bound(const RenderMesh& mesh, RenderMesh::Piece& piece) {
  Vector3f low = Vector3f::Constant(std::numeric_limits<float>::infinity()), high = -low;
  const auto begin = mesh.indices.begin() + piece.first_index, end = begin + piece.index_count;
  for (auto i = begin; i != end; ++i) {
    low = low.cwiseMin(mesh.vertices[*i].position);
    high = high.cwiseMax(mesh.vertices[*i].position);
  }
  const Vector3f centre = 0.5f * (low + high);
  float radius2 = 0.0f;
  for (auto i = begin; i != end; ++i)
    radius2 = std::max(radius2, (mesh.vertices[*i].position - centre).squaredNorm());
  piece.centre = centre.cast<double>();
  piece.radius = std::sqrt(static_cast<double>(radius2));
  piece.low = low.cast<double>();
  piece.high = high.cast<double>();
}

RenderMesh finish(RenderMesh mesh) {
  mesh.pieces.emplace_back().index_count = static_cast<uint32_t>(mesh.indices.size());
  bound(mesh, mesh.pieces.back());
  return mesh;
}

void quad(RenderMesh& mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  mesh.indices.insert(mesh.indices.end(), {a, b, c, a, c, d});
}

// A surface of revolution about z. Each ring is a height, a radius and the slope of its normal.
struct Ring {
  float z, radius, normal_radial, normal_z, v;
};

void revolve(RenderMesh& mesh, const std::vector<Ring>& rings, int segments) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  const auto row =
      static_cast<uint32_t>(segments + 1);  // the seam is doubled for its texture coordinates
  for (const Ring& ring : rings) {
    for (int i = 0; i <= segments; ++i) {
      const double angle = 2.0 * M_PI * (i % segments) / segments;
      const auto c = static_cast<float>(math::cos(angle)), s = static_cast<float>(math::sin(angle));
      mesh.vertices.push_back({{ring.radius * c, ring.radius * s, ring.z},
                               {ring.normal_radial * c, ring.normal_radial * s, ring.normal_z},
                               {static_cast<float>(i) / static_cast<float>(segments), ring.v}});
    }
  }
  for (uint32_t r = 0; r + 1 < rings.size(); ++r) {
    for (uint32_t i = 0; i + 1 < row; ++i) {
      const uint32_t a = first + r * row + i, b = a + 1, c = b + row, d = a + row;
      // A ring of radius 0 is a point: one of the two triangles is degenerate.
      if (rings[r].radius > 0.0f) mesh.indices.insert(mesh.indices.end(), {a, b, c});
      if (rings[r + 1].radius > 0.0f) mesh.indices.insert(mesh.indices.end(), {a, c, d});
    }
  }
}

void disc(RenderMesh& mesh, float z, float radius, bool up, int segments) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  const Vector3f normal(0.0f, 0.0f, up ? 1.0f : -1.0f);
  for (int i = 0; i < segments; ++i) {
    const double angle = 2.0 * M_PI * i / segments;
    const auto c = static_cast<float>(math::cos(angle)), s = static_cast<float>(math::sin(angle));
    mesh.vertices.push_back(
        {{radius * c, radius * s, z}, normal, {0.5f + 0.5f * c, 0.5f + (up ? 0.5f : -0.5f) * s}});
  }
  for (uint32_t i = 1; i + 1 < static_cast<uint32_t>(segments); ++i) {
    mesh.indices.insert(mesh.indices.end(),
                        {first, first + (up ? i : i + 1), first + (up ? i + 1 : i)});
  }
}

std::vector<Ring> half_circle(int segments, double from, double to, double radius, double shift,
                              double v0, double v1) {
  std::vector<Ring> rings;
  for (int i = 0; i <= segments; ++i) {
    const double part = static_cast<double>(i) / segments, angle = from + (to - from) * part;
    const bool pole = std::abs(std::abs(angle) - M_PI / 2) < 1e-9;
    rings.push_back({static_cast<float>(shift + radius * math::sin(angle)),
                     pole ? 0.0f : static_cast<float>(radius * math::cos(angle)),
                     pole ? 0.0f : static_cast<float>(math::cos(angle)),
                     static_cast<float>(math::sin(angle)),
                     static_cast<float>(v0 + (v1 - v0) * part)});
  }
  return rings;
}

}  // namespace

RenderMesh box_mesh() {
  RenderMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0f, 1.0f}) {
      const Vector3f normal = side * Vector3f::Unit(axis);
      // Texture upright on the four sides, x to the right on top and bottom.
      const Vector3f up = axis == 2 ? Vector3f(0.0f, side, 0.0f) : Vector3f::UnitZ();
      const Vector3f right = up.cross(normal);
      const auto first = static_cast<uint32_t>(mesh.vertices.size());
      for (const Vector2f& uv : {Vector2f(0, 0), Vector2f(1, 0), Vector2f(1, 1), Vector2f(0, 1)}) {
        mesh.vertices.push_back(
            {0.5f * normal + (uv.x() - 0.5f) * right + (uv.y() - 0.5f) * up, normal, uv});
      }
      quad(mesh, first, first + 1, first + 2, first + 3);
    }
  }
  return finish(std::move(mesh));
}

RenderMesh plane_mesh() {
  RenderMesh mesh;
  for (const Vector2f& uv : {Vector2f(0, 0), Vector2f(1, 0), Vector2f(1, 1), Vector2f(0, 1)}) {
    mesh.vertices.push_back({{uv.x() - 0.5f, uv.y() - 0.5f, 0.0f}, Vector3f::UnitZ(), uv});
  }
  quad(mesh, 0, 1, 2, 3);
  return finish(std::move(mesh));
}

RenderMesh sphere_mesh(int segments) {
  RenderMesh mesh;
  revolve(mesh, half_circle(segments / 2, -M_PI / 2, M_PI / 2, 1.0, 0.0, 0.0, 1.0), segments);
  return finish(std::move(mesh));
}

RenderMesh cylinder_mesh(int segments) {
  RenderMesh mesh;
  revolve(mesh, {{-0.5f, 1.0f, 1.0f, 0.0f, 0.0f}, {0.5f, 1.0f, 1.0f, 0.0f, 1.0f}}, segments);
  disc(mesh, 0.5f, 1.0f, true, segments);
  disc(mesh, -0.5f, 1.0f, false, segments);
  return finish(std::move(mesh));
}

RenderMesh cone_mesh(int segments) {
  RenderMesh mesh;
  const float slope = std::sqrt(0.5f);  // radius 1 and length 1; normals stay correct when scaled
  revolve(mesh, {{-0.5f, 1.0f, slope, slope, 0.0f}, {0.5f, 0.0f, slope, slope, 1.0f}}, segments);
  disc(mesh, -0.5f, 1.0f, false, segments);
  return finish(std::move(mesh));
}

RenderMesh capsule_mesh(double radius, double length, int segments) {
  std::vector<Ring> rings =
      half_circle(segments / 4, -M_PI / 2, 0.0, radius, -0.5 * length, 0.0, 0.25);
  const std::vector<Ring> top =
      half_circle(segments / 4, 0.0, M_PI / 2, radius, 0.5 * length, 0.75, 1.0);
  rings.insert(rings.end(), top.begin(), top.end());
  RenderMesh mesh;
  revolve(mesh, rings, segments);
  return finish(std::move(mesh));
}

namespace {

using Triangle = std::array<uint32_t, 3>;

Vector3f centroid3(const world::Mesh& mesh, const Triangle& t) {
  return mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]];
}

// Splits the triangles along their longest axis until each part is small enough; [begin, end) is
// reordered.
void cut(const world::Mesh& mesh, std::vector<Triangle>& triangles, size_t begin, size_t end,
         std::vector<std::pair<size_t, size_t>>& parts) {
  if (end - begin <= kPieceTriangles) {
    if (end > begin) parts.emplace_back(begin, end);
    return;
  }
  Vector3f low = centroid3(mesh, triangles[begin]), high = low;
  for (size_t i = begin; i < end; ++i) {
    const Vector3f c = centroid3(mesh, triangles[i]);
    low = low.cwiseMin(c);
    high = high.cwiseMax(c);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const size_t middle = begin + (end - begin) / 2;
  const auto less = [&](const Triangle& a, const Triangle& b) {
    const float ca = centroid3(mesh, a)[axis], cb = centroid3(mesh, b)[axis];
    // a total order gives the same pieces with every standard library
    return ca != cb ? ca < cb : a < b;
  };
  std::nth_element(triangles.begin() + static_cast<long>(begin),
                   triangles.begin() + static_cast<long>(middle),
                   triangles.begin() + static_cast<long>(end), less);
  cut(mesh, triangles, begin, middle, parts);
  cut(mesh, triangles, middle, end, parts);
}

}  // namespace

namespace {

// Every how-manieth height is drawn, with the last one: the picture of a map is bounded.
std::vector<size_t> drawn(size_t heights, size_t step) {
  std::vector<size_t> some;
  for (size_t i = 0; i + 1 < heights; i += step) some.push_back(i);
  some.push_back(heights - 1);
  return some;
}

// Smooth. Of more than 1025 heights in a direction every second, third, ... is drawn, so that this
// many are enough: two million triangles.
RenderMesh grid_mesh(const world::HeightMap& map) {
  constexpr size_t kMostCells = 1024, kCellsOfPiece = 44;
  static_assert(2 * kCellsOfPiece * kCellsOfPiece <= kPieceTriangles);
  const world::HeightGrid& grid = *map.grid;
  const size_t step = (std::max(grid.rows(), grid.columns()) - 2) / kMostCells + 1;
  const std::vector<size_t> rows = drawn(grid.rows(), step), columns = drawn(grid.columns(), step);
  const size_t count = columns.size();
  RenderMesh out;
  out.vertices.reserve(rows.size() * count);
  for (size_t i = 0; i < rows.size(); ++i) {
    const size_t up = rows[i ? i - 1 : 0], down = rows[std::min(i + 1, rows.size() - 1)];
    for (size_t k = 0; k < count; ++k) {
      const size_t row = rows[i], column = columns[k], left = columns[k ? k - 1 : 0],
                   right = columns[std::min(k + 1, count - 1)];
      const Vector3f along_x = grid.vertex(row, right) - grid.vertex(row, left),
                     along_y = grid.vertex(up, column) - grid.vertex(down, column);
      const Vector2f uv =
          Eigen::Vector2d(static_cast<double>(column) / static_cast<double>(grid.columns() - 1),
                          1.0 - static_cast<double>(row) / static_cast<double>(grid.rows() - 1))
              .cast<float>();
      out.vertices.push_back({grid.vertex(row, column), along_x.cross(along_y).normalized(),
                              uv.cwiseProduct(map.tiles)});
    }
  }
  for (size_t i0 = 0; i0 + 1 < rows.size(); i0 += kCellsOfPiece) {
    for (size_t k0 = 0; k0 + 1 < count; k0 += kCellsOfPiece) {
      RenderMesh::Piece piece;
      piece.first_index = static_cast<uint32_t>(out.indices.size());
      for (size_t i = i0; i < std::min(i0 + kCellsOfPiece, rows.size() - 1); ++i) {
        for (size_t k = k0; k < std::min(k0 + kCellsOfPiece, count - 1); ++k) {
          const auto a = static_cast<uint32_t>(i * count + k), c = a + static_cast<uint32_t>(count);
          out.indices.insert(out.indices.end(), {a, c, a + 1, a + 1, c, c + 1});
        }
      }
      piece.index_count = static_cast<uint32_t>(out.indices.size()) - piece.first_index;
      piece.material = map.parts[0].material;
      bound(out, piece);
      out.pieces.push_back(piece);
    }
  }
  return out;
}

}  // namespace

RenderMesh file_mesh(const world::Mesh& mesh) {
  if (const world::HeightMap* map = world::height_map(mesh)) return grid_mesh(*map);
  const size_t count = mesh.positions.size();
  const bool smooth = mesh.normals.size() == count;
  const bool mapped = mesh.uvs.size() == count;
  RenderMesh out;
  if (smooth) {
    out.vertices.resize(count);
    for (size_t i = 0; i < count; ++i) {
      out.vertices[i] = {mesh.positions[i], mesh.normals[i], mapped ? mesh.uvs[i] : Vector2f(0, 0)};
    }
  }
  std::vector<world::Mesh::Part> parts = mesh.parts;
  if (parts.empty()) parts.push_back({"", 0, static_cast<uint32_t>(mesh.triangles.size()), {}});
  for (const world::Mesh::Part& part : parts) {
    std::vector<Triangle> triangles;
    const size_t end =
        std::min<size_t>(size_t{part.first_triangle} + part.triangle_count, mesh.triangles.size());
    for (size_t i = part.first_triangle; i < end; ++i) {
      const Triangle& t = mesh.triangles[i];
      if (std::max({t[0], t[1], t[2]}) < count) triangles.push_back(t);
    }
    std::vector<std::pair<size_t, size_t>> ranges;
    cut(mesh, triangles, 0, triangles.size(), ranges);
    for (const auto& [first, last] : ranges) {
      RenderMesh::Piece piece;
      piece.first_index = static_cast<uint32_t>(out.indices.size());
      piece.index_count = static_cast<uint32_t>(3 * (last - first));
      piece.material = part.material;
      for (size_t i = first; i < last; ++i) {
        const Triangle& t = triangles[i];
        if (smooth) {
          out.indices.insert(out.indices.end(), t.begin(), t.end());
          continue;
        }
        const Vector3f& a = mesh.positions[t[0]];
        const Vector3f normal =
            (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a).normalized();
        for (const uint32_t corner : t) {
          out.indices.push_back(static_cast<uint32_t>(out.vertices.size()));
          out.vertices.push_back(
              {mesh.positions[corner], normal, mapped ? mesh.uvs[corner] : Vector2f(0, 0)});
        }
      }
      bound(out, piece);
      out.pieces.push_back(piece);
    }
  }
  return out;
}

}  // namespace ruedo::scene
