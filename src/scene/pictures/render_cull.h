// Finds the parts of the world that a view sees, as runs of instances in drawing order.
//
// The result depends on the snapshot and the view alone, never on earlier pictures.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scene/pictures/render_content.h"
#include "scene/pictures/render_scene.h"

namespace ruedo::scene {

// One part to draw: the vertex attributes 3 to 9 of the shaders.
struct Instance {
  float rows[3][4];  // from mesh coordinates to the world's axes, relative to the eye
  world::Rgba diffuse, specular, emissive;
  uint32_t label;
  uint32_t padding[3];
};

struct Run {
  int batch;
  uint32_t first, count;  // of DrawList::instances
  friend bool operator==(const Run&, const Run&) = default;
};

struct DrawList {
  std::vector<Instance> instances;
  std::vector<Run> opaque;       // by batch, front to back
  std::vector<Run> transparent;  // back to front
  std::vector<std::pair<Vec3, double>>
      spheres;  // collect_casters() only: bounds of the links, m, world
};

// Whether what is opaque is the same, to the bit.
bool same_drawing(const DrawList& a, const DrawList& b);

// A convex region bounded by planes n.p + d >= 0 with normals pointing inwards, in world
// coordinates.
struct Region {
  struct Plane {
    Vec3 normal;
    double d;
  };
  std::vector<Plane> planes;
  bool touches(const Vec3& centre, double radius) const {
    for (const Plane& plane : planes) {
      if (plane.normal.dot(centre) + plane.d < -radius) return false;
    }
    return true;
  }
};

Region view_region(const View& view);

enum class Movers { only_static, only_moving };

class Culler {
 public:
  // The arguments must outlive it.
  Culler(const world::BodyLayout& layout, const RenderContent& content);

  void update(const Snapshot& snapshot);
  const Affine& link_pose(LinkIndex link) const { return M_WL_[link]; }

  // Instances are relative to `origin`. pixels_per_radian: for dropping what is smaller than a
  // pixel, and for coarser round shapes; 0: everything in full.
  void collect(const Region& region, const Vec3& origin, double pixels_per_radian,
               bool orthographic, DrawList& list);
  // The shadow casters of the region, relative to `origin`.
  void collect_casters(const Region& region, const Vec3& origin, Movers movers, DrawList& list);

 private:
  struct Item {
    int rank, batch;
    float distance;
    LinkIndex link;
    const RenderPart* part;
  };
  void append(std::vector<Item>& items, const Vec3& origin, std::vector<Run>& runs,
              std::vector<Instance>& instances) const;

  const world::BodyLayout& layout_;
  const RenderContent& content_;
  std::vector<int> rank_;  // drawing order of each batch
  IndexedVector<LinkIndex, Affine> M_WL_;
  std::vector<LinkIndex> visible_links_, moving_links_, static_links_;  // with something to draw
  std::vector<Item> opaque_, transparent_;
};

}  // namespace ruedo::scene
