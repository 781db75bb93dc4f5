// <geometry> to Geometry.
#include "model/geometry.h"

#include <stdexcept>

namespace ruedo::model {
namespace {

std::optional<Geometry> read_mesh(const Element& mesh, const std::string& where,
                                  ReadContext& context) {
  report_other_children(mesh, {"uri", "scale", "submesh"}, {"convex_decomposition"}, where,
                        context.findings);
  Geometry geometry;
  geometry.shape = Shape::mesh;
  geometry.scale = mesh.vector3("scale", Vec3::Ones(), Allowed::any(quantity::kFactor));
  for (int i = 0; i < 3; ++i) {
    if (geometry.scale[i] == 0)
      mesh.child("scale")->fail("'" + mesh.child("scale")->text +
                                "' has a zero; a mesh cannot be flat");
  }
  const std::string uri = mesh.string("uri", "");
  if (uri.empty()) mesh.fail("has no <uri>");
  const auto path = context.resources.find(uri, mesh.source.file);
  if (!path) {
    context.findings.error(mesh.source, where,
                           "the mesh '" + uri + "' " +
                               context.resources.why_not(uri, mesh.source.file) +
                               "; the shape is left out");
    return std::nullopt;
  }
  try {
    if (const Element* submesh = mesh.child("submesh")) {
      geometry.mesh = context.meshes.load_submesh(*path, submesh->string("name", ""),
                                                  submesh->boolean("center", false));
    } else {
      geometry.mesh = context.meshes.load(*path);
    }
  } catch (const std::runtime_error& error) {
    context.findings.error(
        mesh.source, where,
        "the mesh '" + uri + "' cannot be used: " + error.what() + "; the shape is left out");
    return std::nullopt;
  }
  return geometry;
}

std::optional<Geometry> read_polyline(const Element& geometry_element, const Element& first,
                                      const std::string& where, ReadContext& context) {
  std::vector<std::vector<Eigen::Vector2d>> polygons;
  for (const Element* polyline : geometry_element.all("polyline")) {
    std::vector<Eigen::Vector2d> polygon;
    for (const Element* point : polyline->all("point")) {
      const std::vector<double> v = point->as_numbers(Allowed::any(quantity::kLength));
      if (v.size() != 2)
        point->fail("'" + point->text + "' has " + std::to_string(v.size()) +
                    " numbers; allowed are x y");
      polygon.emplace_back(v[0], v[1]);
    }
    polygons.push_back(std::move(polygon));
  }
  const double height = first.number("height", 1.0, Allowed::positive(quantity::kLength));
  try {
    auto mesh = std::make_shared<Mesh>(extruded(polygons, height));
    mesh->name = first.source.str();
    Geometry geometry;
    geometry.shape = Shape::mesh;
    geometry.mesh = std::move(mesh);
    return geometry;
  } catch (const std::runtime_error& error) {
    context.findings.error(
        first.source, where,
        std::string("the polyline cannot be used: ") + error.what() + "; the shape is left out");
    return std::nullopt;
  }
}

// The first <texture>'s diffuse picture, tiled over the ground. Gazebo blends further ones in by
// height; here they are named.
void cover_with_texture(const Element& element, const Vec3& size, Mesh& mesh,
                        const std::string& where, ReadContext& context) {
  const Element* texture = element.child("texture");
  const Element* picture = texture ? texture->child("diffuse") : nullptr;
  if (!picture) return;
  for (const auto& child : element.children) {
    if (child->name != "texture" || child.get() == texture) continue;
    context.findings.unsupported(child->source, where,
                                 "a heightmap has one <texture>; this one is not blended in");
  }
  const double tile_m = texture->number("size", 10.0, Allowed::positive(quantity::kLength));
  const auto path = context.resources.find_texture(picture->text, picture->source.file);
  if (!path) {
    context.findings.unsupported(
        picture->source, where,
        "the texture '" + picture->text + "' is not found; the ground is plain");
    return;
  }
  context.documents.note(*path);
  Material ground;
  ground.ambient = ground.diffuse = {1.0f, 1.0f, 1.0f, 1.0f};
  ground.texture = std::make_shared<Texture>(Texture{*path, {}});
  mesh.materials.push_back(std::move(ground));
  for (Mesh::Part& part : mesh.parts) part.material = 0;
  const Eigen::Vector2f tiles = (size.head<2>() / tile_m).cast<float>();
  for (Eigen::Vector2f& uv : mesh.uvs) uv = uv.cwiseProduct(tiles);
}

std::optional<Geometry> read_heightmap(const Element& element, const std::string& where,
                                       ReadContext& context) {
  report_other_children(element, {"uri", "size", "pos", "texture"},
                        {"use_terrain_paging", "sampling", "blend"}, where, context.findings);
  const std::string uri = element.string("uri", "");
  if (uri.empty()) element.fail("has no <uri>");
  const Vec3 size = element.vector3("size", Vec3::Ones(), Allowed::any(quantity::kLength));
  if (size.minCoeff() <= 0)
    element.child("size")->fail("'" + element.child("size")->text +
                                "' is not allowed; sizes are above 0");
  const auto path = context.resources.find(uri, element.source.file);
  if (!path) {
    context.findings.error(element.source, where,
                           "the heightmap '" + uri + "' " +
                               context.resources.why_not(uri, element.source.file) +
                               "; the shape is left out");
    return std::nullopt;
  }
  context.documents.note(*path);
  auto mesh = std::make_shared<Mesh>();
  try {
    *mesh = heightmap(*path, size);
  } catch (const std::runtime_error& error) {
    context.findings.error(
        element.source, where,
        "the heightmap '" + uri + "' cannot be used: " + error.what() + "; the shape is left out");
    return std::nullopt;
  }
  cover_with_texture(element, size, *mesh, where, context);
  const Vec3 at = element.vector3("pos", Vec3::Zero(), Allowed::any(quantity::kLength));
  for (auto& p : mesh->positions) p += at.cast<float>();
  mesh->name = *path;
  Geometry geometry;
  geometry.shape = Shape::mesh;
  geometry.mesh = std::move(mesh);
  return geometry;
}

// The corners of a mesh, times its scale, are lengths that no reader of numbers has seen.
bool is_too_large(const Geometry& g, const Element& element, const std::string& where,
                  ReadContext& context) {
  const Eigen::AlignedBox3d box = bounds(g);
  const double reach =
      box.isEmpty() ? 0.0
                    : std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  if (reach <= quantity::kLength.most) return false;
  context.findings.error(element.source, where,
                         "the mesh reaches to " + shown(reach) + " m; allowed is up to " +
                             shown(quantity::kLength.most) + " m; the shape is left out");
  return true;
}

}  // namespace

std::optional<Geometry> read_geometry(const Element& element, const std::string& where,
                                      ReadContext& context) {
  const Element* shape = nullptr;
  for (const auto& child : element.children) {
    if (child->name == "empty") return std::nullopt;
    if (child->name.find(':') != std::string::npos)
      child->fail("is not allowed here; <geometry> has no elements of ruedo:");
    if (shape && child->name != "polyline") child->fail("is a second shape; <geometry> holds one");
    if (!shape) shape = child.get();
  }
  if (!shape) return std::nullopt;
  // Converters write shapes of size zero for what has none: they are nothing. Negative sizes are
  // errors.
  const Allowed not_negative = Allowed::not_negative(quantity::kLength),
                length = Allowed::any(quantity::kLength);
  const auto nothing = [&](const char* name) {
    context.findings.repaired(
        shape->source, where,
        "a <" + shape->name + "> whose <" + name + "> is 0; the shape is left out");
    return std::nullopt;
  };
  const auto required = [&](const char* name) {
    if (!shape->has(name)) shape->fail(std::string("has no <") + name + ">");
    return shape->number(name, 0, not_negative);
  };
  // Where SDF has a default, a file may rely on it.
  const auto or_default = [&](const char* name, const auto& value) {
    if (!shape->has(name))
      context.findings.repaired(shape->source, where,
                                "a <" + shape->name + "> without <" + name + ">; it is " + value +
                                    " as in SDF's description");
  };
  const std::string& kind = shape->name;
  Geometry g;
  if (kind == "box") {
    g.shape = Shape::box;
    or_default("size", "1 1 1");
    g.size = shape->vector3("size", Vec3::Ones(), length);
    if (g.size.minCoeff() < 0)
      shape->child("size")->fail("'" + shape->child("size")->text +
                                 "' is not allowed; sizes are above 0");
    if (g.size.minCoeff() == 0) return nothing("size");
  } else if (kind == "sphere") {
    g.shape = Shape::sphere;
    or_default("radius", "1");
    g.size = Vec3::Constant(shape->number("radius", 1, not_negative));
    if (g.size.x() == 0) return nothing("radius");
  } else if (kind == "cylinder" || kind == "capsule" || kind == "cone") {
    g.shape = kind == "cylinder" ? Shape::cylinder : kind == "cone" ? Shape::cone : Shape::capsule;
    g.size = {required("radius"), required("length"), 0};
    if (g.size.x() == 0) return nothing("radius");
    if (g.size.y() == 0 && kind != "capsule") return nothing("length");
  } else if (kind == "ellipsoid") {
    g.shape = Shape::ellipsoid;
    or_default("radii", "1 1 1");
    g.size = shape->vector3("radii", Vec3::Ones(), length);
    if (g.size.minCoeff() < 0)
      shape->child("radii")->fail("'" + shape->child("radii")->text +
                                  "' is not allowed; radii are above 0");
    if (g.size.minCoeff() == 0) return nothing("radii");
  } else if (kind == "plane") {
    g.shape = Shape::plane;
    const Vec3 normal = shape->vector3("normal", Vec3::UnitZ(), Allowed::any(quantity::kFactor));
    if (!(normal.norm() > 1e-9))
      shape->child("normal")->fail("'" + shape->child("normal")->text +
                                   "' is not allowed; a normal is not zero");
    g.normal = normal.normalized();
    if (const Element* size = shape->child("size")) {
      std::vector<double> v = size->as_numbers(length);
      if (v.size() == 3) {  // of a box, which some files have here
        context.findings.repaired(size->source, where,
                                  "<size> of a plane has two numbers; the third is left out");
        v.pop_back();
      }
      if (v.size() != 2 || v[0] <= 0 || v[1] <= 0)
        size->fail("'" + size->text + "' is not allowed; allowed are two numbers above 0");
      g.extent = {v[0], v[1]};
    }
  } else if (kind == "mesh") {
    std::optional<Geometry> mesh = read_mesh(*shape, where, context);
    return mesh && is_too_large(*mesh, *shape, where, context) ? std::nullopt : mesh;
  } else if (kind == "polyline") {
    return read_polyline(element, *shape, where, context);
  } else if (kind == "heightmap") {
    std::optional<Geometry> ground = read_heightmap(*shape, where, context);
    return ground && is_too_large(*ground, *shape, where, context) ? std::nullopt : ground;
  } else {
    const std::string near =
        nearest_word(kind, {"box", "sphere", "cylinder", "capsule", "cone", "ellipsoid", "plane",
                            "mesh", "polyline", "heightmap"});
    context.findings.unsupported(shape->source, where,
                                 "the shape <" + kind + "> is not supported and left out" +
                                     (near.empty() ? "" : "; did you mean <" + near + ">?"));
    return std::nullopt;
  }
  return g;
}

Eigen::AlignedBox3d bounds(const Geometry& g) {
  Vec3 half = Vec3::Zero();
  switch (g.shape) {
    case Shape::box: half = g.size / 2; break;
    case Shape::sphere: half = Vec3::Constant(g.size.x()); break;
    case Shape::ellipsoid: half = g.size; break;
    case Shape::cylinder:
    case Shape::cone: half = {g.size.x(), g.size.x(), g.size.y() / 2}; break;
    case Shape::capsule: half = {g.size.x(), g.size.x(), g.size.y() / 2 + g.size.x()}; break;
    case Shape::plane: return {};
    case Shape::mesh: {
      Eigen::AlignedBox3d box;
      for (const auto& p : g.mesh->positions) box.extend(g.scale.cwiseProduct(p.cast<double>()));
      return box;
    }
  }
  return {-half, half};
}

}  // namespace ruedo::model
