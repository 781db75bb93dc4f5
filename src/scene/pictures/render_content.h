// The content of pictures, prepared once from the world: meshes, surfaces, and each kind of link's
// parts. Plain data, without OpenGL. A thousand robots of one model share their parts; all boxes
// of a world share a mesh.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "ruedo/snapshot.h"
#include "scene/pictures/render_mesh.h"
#include "scene/pictures/render_scene.h"
#include "world/model/body_layout.h"

namespace ruedo::scene {

using Affine = Eigen::Matrix<double, 3, 4>;  // [M | t]: p' = M p + t

Affine to_affine(const Pose& pose);
Affine compose(const Affine& a, const Affine& b);  // first b, then a

// Shading flags of a batch; a combination selects the program and face culling.
enum BatchFlags : uint32_t {
  kTextured = 1,     // a texture multiplies the diffuse colour
  kSpecular = 2,     // has a highlight
  kGround = 4,       // an untextured ground plane: has a grid and fades out at its edge
  kDoubleSided = 8,  // back faces are drawn
  kMirrored = 16,    // the scale has an odd number of negative factors: clockwise is outside
  kRound = 32,       // a sphere or an ellipsoid, which depth and labels show as such
};

using TextureIndex = Index<struct TextureKind>;  // into RenderContent::textures

// Triangles that one draw call can draw in many instances.
struct Batch {
  int mesh = 0;
  uint32_t first_index = 0, index_count = 0;
  TextureIndex texture;
  uint32_t flags = 0;
  friend auto operator<=>(const Batch&, const Batch&) = default;
};

// A part of a visual, in the frame of its link.
struct RenderPart {
  Affine M_LP;                   // from mesh coordinates to the link
  Vec3 centre_L = Vec3::Zero();  // bounding sphere
  double radius = 0.0;
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // bounding box, in mesh coordinates
  int batch = 0, small_batch = 0;  // indices into RenderContent::batches; small: for distant views
  world::Rgba diffuse{}, specular{},
      emissive{};  // specular[3] is the shininess; diffuse[3] the opacity
  bool transparent = false;
  bool casts_shadow = true;
};

struct RenderLinkKind {
  std::vector<RenderPart> parts;
  Vec3 centre_L = Vec3::Zero();
  double radius = 0.0;
};

// A light and the link that carries it.
struct RenderLight {
  world::Light light;
  LinkIndex link;  // none: the world
};

using RenderKindIndex = Index<RenderLinkKind>;  // into RenderContent::link_kinds

struct RenderContent {
  std::vector<RenderMesh> meshes;
  IndexedVector<TextureIndex, std::shared_ptr<const world::Texture>> textures;
  std::vector<Batch> batches;
  bool has_round = false;  // a batch is kRound
  IndexedVector<RenderKindIndex, RenderLinkKind> link_kinds;
  IndexedVector<LinkIndex, RenderKindIndex> kind_of_link;  // not valid: nothing to draw
  IndexedVector<LinkIndex, uint16_t> label_of_link;
  std::vector<RenderLight> lights;
  Bounds bounds{Vec3::Constant(-3.0),
                // bounds of all that is drawn at the start, except the ground
                Vec3::Constant(3.0)};

  RenderContent(const world::WorldModel& world, const world::BodyLayout& layout);

 private:
  void find_bounds(const world::BodyLayout& layout);
};

// The pose of a link in a snapshot, including its wheel's rotation.
Pose link_pose(const world::BodyLayout& layout, const Snapshot& snapshot, LinkIndex link);

}  // namespace ruedo::scene
