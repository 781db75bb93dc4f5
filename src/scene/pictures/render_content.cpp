#include "scene/pictures/render_content.h"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>

namespace ruedo::scene {
namespace {

using world::Rgba;

// Segments of round shapes, close up and at a distance.
constexpr int kSegments = 32, kFewSegments = 10;

// A horizontal plane of at least this size in metres counts as the ground.
constexpr double kGroundExtent = 20.0;

// Builds the tables of a RenderContent; equal things share an entry.
class Builder {
 public:
  explicit Builder(RenderContent& content) : content_(content) {}

  RenderLinkKind link_kind(const world::Link& link) {
    RenderLinkKind kind;
    for (const world::Visual& visual : link.visuals) add(visual, kind.parts);
    if (kind.parts.empty()) return kind;
    Vec3 low = kind.parts[0].centre_L, high = low;
    for (const RenderPart& part : kind.parts) {
      low = low.cwiseMin(part.centre_L - Vec3::Constant(part.radius));
      high = high.cwiseMax(part.centre_L + Vec3::Constant(part.radius));
    }
    kind.centre_L = 0.5 * (low + high);
    for (const RenderPart& part : kind.parts) {
      kind.radius = std::max(kind.radius, (part.centre_L - kind.centre_L).norm() + part.radius);
    }
    return kind;
  }

 private:
  struct MeshPair {
    int mesh, small_mesh;
    Vec3 scale;
    Quat rotation = Quat::Identity();
  };

  template <class Make>
  int mesh(const std::tuple<const void*, int, double, double, int>& key, const Make& make) {
    const auto [at, inserted] = meshes_.try_emplace(key, static_cast<int>(content_.meshes.size()));
    if (inserted) content_.meshes.push_back(make());
    return at->second;
  }
  template <class Make>
  MeshPair round_mesh(world::Shape shape, const Vec3& scale, const Make& make, double a = 0,
                      double b = 0) {
    const auto one = [&](int segments) {
      return mesh({nullptr, static_cast<int>(shape), a, b, segments},
                  [&] { return make(segments); });
    };
    return {one(kSegments), one(kFewSegments), scale};
  }
  MeshPair only_mesh(int index, const Vec3& scale) { return {index, index, scale}; }

  MeshPair meshes_of(const world::Geometry& g) {
    using world::Shape;
    const double r = g.size.x(), length = g.size.y();
    switch (g.shape) {
      case Shape::box:
        return only_mesh(mesh({nullptr, static_cast<int>(g.shape), 0, 0, 0}, box_mesh), g.size);
      case Shape::sphere: return round_mesh(Shape::sphere, {r, r, r}, sphere_mesh);
      case Shape::ellipsoid: return round_mesh(Shape::sphere, g.size, sphere_mesh);
      case Shape::cylinder: return round_mesh(g.shape, {r, r, length}, cylinder_mesh);
      case Shape::cone: return round_mesh(g.shape, {r, r, length}, cone_mesh);
      case Shape::capsule:
        return round_mesh(
            g.shape, Vec3::Ones(), [&](int segments) { return capsule_mesh(r, length, segments); },
            r, length);
      case Shape::plane: {
        MeshPair pair = only_mesh(mesh({nullptr, static_cast<int>(g.shape), 0, 0, 0}, plane_mesh),
                                  {g.extent.x(), g.extent.y(), 1.0});
        pair.rotation = Quat::FromTwoVectors(Vec3::UnitZ(), g.normal);
        return pair;
      }
      case Shape::mesh: break;
    }
    return only_mesh(mesh({g.mesh.get(), 0, 0, 0, 0}, [&] { return file_mesh(*g.mesh); }), g.scale);
  }

  TextureIndex texture(const std::shared_ptr<const world::Texture>& texture) {
    if (!texture) return {};
    // Many materials may name the same file: it is uploaded once.
    for (const TextureIndex i : content_.textures.indices()) {
      const world::Texture& other = *content_.textures[i];
      if (&other == texture.get() || (!texture->path.empty() && other.path == texture->path))
        return i;
    }
    const TextureIndex index = content_.textures.next();
    content_.textures.push_back(texture);
    return index;
  }

  int batch(const Batch& wanted) {
    const auto [at, inserted] =
        batches_.try_emplace(wanted, static_cast<int>(content_.batches.size()));
    if (inserted) content_.batches.push_back(wanted);
    return at->second;
  }

  void add(const world::Visual& visual, std::vector<RenderPart>& parts) {
    const world::Geometry& g = visual.geometry;
    if (g.shape == world::Shape::mesh && !g.mesh) return;
    const MeshPair pair = meshes_of(g);
    const Affine M_LP =
        compose(to_affine(visual.X_LV * Pose{pair.rotation, Vec3::Zero()}),
                (Affine() << Eigen::Matrix3d(pair.scale.asDiagonal()), Vec3::Zero()).finished());
    const auto& pieces = content_.meshes[pair.mesh].pieces;
    for (size_t i = 0; i < pieces.size(); ++i) {
      const RenderMesh::Piece& piece = pieces[i];
      if (piece.index_count == 0) continue;
      const world::Material material =
          visual.material ? *visual.material : own_material(g, piece.material);
      RenderPart part;
      part.M_LP = M_LP;
      part.centre_L = M_LP.leftCols<3>() * piece.centre + M_LP.col(3);
      part.radius = piece.radius * pair.scale.cwiseAbs().maxCoeff();
      part.low = piece.low;
      part.high = piece.high;
      shade(material, visual, part);
      if (part.diffuse[3] < 0.004f) continue;  // invisible
      Batch b{pair.mesh, piece.first_index, piece.index_count, texture(material.texture), 0};
      if (b.texture.valid()) b.flags |= kTextured;
      if (std::max({part.specular[0], part.specular[1], part.specular[2]}) > 0.02f)
        b.flags |= kSpecular;
      if (material.double_sided) b.flags |= kDoubleSided;
      if (M_LP.leftCols<3>().determinant() < 0.0) b.flags |= kMirrored;
      const bool round = g.shape == world::Shape::sphere || g.shape == world::Shape::ellipsoid;
      if (round && !material.double_sided) b.flags |= kRound;
      content_.has_round |= round;
      if (g.shape == world::Shape::plane && !b.texture.valid() && g.normal.z() > 0.999 &&
          g.extent.minCoeff() >= kGroundExtent) {
        b.flags |= kGround;
      }
      if (g.shape == world::Shape::plane) part.casts_shadow = false;
      part.batch = batch(b);
      if (pair.small_mesh != pair.mesh) {
        const RenderMesh::Piece& small = content_.meshes[pair.small_mesh].pieces[i];
        b.mesh = pair.small_mesh;
        b.first_index = small.first_index;
        b.index_count = small.index_count;
        part.small_batch = batch(b);
      } else {
        part.small_batch = part.batch;
      }
      parts.push_back(part);
    }
  }

  static world::Material own_material(const world::Geometry& g, world::MaterialIndex index) {
    return g.mesh && g.mesh->materials.has(index) ? g.mesh->materials[index] : world::Material();
  }

  static void shade(const world::Material& material, const world::Visual& visual,
                    RenderPart& part) {
    part.diffuse = material.diffuse;
    // Old worlds often give only the ambient colour.
    const auto black = [](const Rgba& c) { return c[0] + c[1] + c[2] < 0.003f; };
    if (black(part.diffuse) && !black(material.ambient)) part.diffuse = material.ambient;
    // Many files write opacity 0 where they mean 1 (COLLADA has two opposite conventions); things
    // that shall be invisible have SDF's transparency.
    const float opacity = material.diffuse[3] < 0.004f ? 1.0f : material.diffuse[3];
    part.diffuse[3] =
        std::clamp(opacity * static_cast<float>(1.0 - visual.transparency), 0.0f, 1.0f);
    part.transparent = part.diffuse[3] < 0.996f;
    part.specular = material.specular;
    part.specular[3] = std::clamp(material.shininess, 1.0f, 128.0f);
    part.emissive = material.emissive;
    part.casts_shadow = visual.cast_shadows && !part.transparent;
  }

  RenderContent& content_;
  std::map<std::tuple<const void*, int, double, double, int>, int>
      meshes_;  // only looked up, never iterated: its order is not defined
  std::map<Batch, int> batches_;
};

}  // namespace

Affine to_affine(const Pose& pose) {
  Affine m;
  m.leftCols<3>() = pose.rotation.toRotationMatrix();
  m.col(3) = pose.translation;
  return m;
}

Affine compose(const Affine& a, const Affine& b) {
  Affine m;
  m.leftCols<3>().noalias() = a.leftCols<3>() * b.leftCols<3>();
  m.col(3) = a.leftCols<3>() * b.col(3) + a.col(3);
  return m;
}

Pose link_pose(const world::BodyLayout& layout, const Snapshot& snapshot, LinkIndex link) {
  const world::LinkPlacement& placement = layout.links[link];
  if (!placement.body.valid()) return placement.X_BL;
  return snapshot.bodies[placement.body] * layout.link_in_body(link, snapshot.wheel_angles);
}

namespace {

// The labels of a picture: from 1 on for what the world lists, 0 for everything else.
IndexedVector<LinkIndex, uint16_t> labels_of(const world::BodyLayout& layout) {
  IndexedVector<BodyIndex, size_t> label_of_body(layout.bodies.size());
  IndexedVector<LinkIndex, size_t> label_of_static(layout.links.size());
  for (size_t i = 0; i < layout.listed.size(); ++i) {
    const world::ListedBody& listed = layout.listed[i];
    (listed.body.valid() ? label_of_body[listed.body] : label_of_static[listed.link]) = i + 1;
  }
  IndexedVector<LinkIndex, uint16_t> labels;
  for (const LinkIndex i : layout.links.indices()) {
    const BodyIndex body = layout.links[i].body;
    const size_t label = body.valid() ? label_of_body[body] : label_of_static[i];
    labels.push_back(static_cast<uint16_t>(std::min<size_t>(label, 65535)));
  }
  return labels;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Bounds bounds_of(const RenderPart& part, const Pose& X_WL) {
  Bounds bounds{Vec3::Constant(kInfinity), Vec3::Constant(-kInfinity)};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p((corner & 1) != 0 ? part.high.x() : part.low.x(),
                 (corner & 2) != 0 ? part.high.y() : part.low.y(),
                 (corner & 4) != 0 ? part.high.z() : part.low.z());
    const Vec3 p_W = X_WL * Vec3(part.M_LP.leftCols<3>() * p + part.M_LP.col(3));
    bounds.low = bounds.low.cwiseMin(p_W);
    bounds.high = bounds.high.cwiseMax(p_W);
  }
  return bounds;
}

// A world without a light gets a high afternoon sun, so that something is visible.
world::Light afternoon_sun() {
  world::Light sun;
  sun.name = "default";
  sun.type = world::Light::Type::directional;
  sun.direction = Vec3(-0.5, 0.35, -0.9).normalized();
  sun.diffuse = {0.8f, 0.8f, 0.8f, 1.0f};
  sun.cast_shadows = true;
  return sun;
}

}  // namespace

RenderContent::RenderContent(const world::WorldModel& world, const world::BodyLayout& layout)
    : label_of_link(labels_of(layout)) {
  Builder builder(*this);
  std::map<const world::Link*, RenderKindIndex> kinds;  // only looked up, never iterated
  for (const LinkIndex i : layout.links.indices()) {
    const world::LinkPlacement& placement = layout.links[i];
    kind_of_link.emplace_back();
    if (world.models[placement.instance].removed) {
      label_of_link[i] = 0;
      continue;
    }
    const world::Link& link = world.models[placement.instance].model->links[placement.link];
    const auto [kind, inserted] = kinds.try_emplace(&link);
    if (inserted) {
      RenderLinkKind built = builder.link_kind(link);
      if (!built.parts.empty()) {
        kind->second = link_kinds.next();
        link_kinds.push_back(std::move(built));
      }
    }
    kind_of_link[i] = kind->second;
    for (const world::Light& light : link.lights) lights.push_back({light, i});
  }
  for (const world::Light& light : world.lights) lights.push_back({light, {}});
  if (lights.empty()) lights.push_back({afternoon_sun(), {}});
  find_bounds(layout);
}

void RenderContent::find_bounds(const world::BodyLayout& layout) {
  Bounds all{Vec3::Constant(kInfinity), Vec3::Constant(-kInfinity)};
  for (const LinkIndex i : layout.links.indices()) {
    if (!kind_of_link[i].valid()) continue;
    const world::LinkPlacement& placement = layout.links[i];
    const Pose X_WL = placement.body.valid() ? layout.bodies[placement.body].X_WB * placement.X_BL
                                             : placement.X_BL;
    for (const RenderPart& part : link_kinds[kind_of_link[i]].parts) {
      if ((batches[part.batch].flags & kGround) != 0) continue;
      const Bounds of_part = bounds_of(part, X_WL);
      all.low = all.low.cwiseMin(of_part.low);
      all.high = all.high.cwiseMax(of_part.high);
    }
  }
  if (all.low.x() <= all.high.x()) bounds = all;
}

}  // namespace ruedo::scene
