// How many triangles the meshes of a world have: each takes some hundred bytes, once for every
// scale of its mesh (for collisions, rays and pictures), and for rays at every static place.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <tuple>

#include "ruedo/element.h"
#include "ruedo/pose.h"
#include "world/model/mesh.h"

namespace ruedo::world {

struct Model;
struct WorldModel;

inline constexpr int64_t kMostTriangles = 10'000'000;        // of all meshes at all scales
inline constexpr int64_t kMostPlacedTriangles = 40'000'000;  // of collisions at fixed places

// Of what is read for one world.
class TriangleCount {
 public:
  // Throws TooLarge, which names `shape`, if a mesh that was not there at that scale makes them too
  // many.
  void add(const std::shared_ptr<const Mesh>& mesh, const Vec3& scale, const Element& shape);

 private:
  std::set<std::tuple<std::shared_ptr<const Mesh>, double, double, double>> seen_;
  int64_t triangles_ = 0;
};

// "": the collisions of the models that stand still have few enough triangles, with those of
// `more`, too.
std::string placed_triangles_fault(const WorldModel& world, const Model* more = nullptr);

}  // namespace ruedo::world
