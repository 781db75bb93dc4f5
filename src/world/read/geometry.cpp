// Reads <geometry> into Geometry.
#include "world/read/geometry.h"

#include "base/text.h"
#include "world/model/bounds.h"
#include "world/read/height_maps.h"

#include <stdexcept>

namespace ruedo::world {
namespace {

constexpr int64_t kMostPieces = 64;

// The largest number of convex pieces of a mesh that moves: 1 for its hull.
size_t most_pieces(const Element& mesh, const std::string& where, ReadContext& context) {
  const std::string* optimization = mesh.attribute("optimization");
  if (optimization && *optimization == "convex_hull") return 1;
  if (optimization && !optimization->empty() && *optimization != "convex_decomposition")
    mesh.fail("optimization='" + *optimization +
              "' is not allowed; allowed are convex_hull and convex_decomposition");
  const Element* decomposition = mesh.child("convex_decomposition");
  if (!decomposition) return kMostPieces;
  report_other_children(*decomposition, {"max_convex_hulls"}, {"voxel_resolution"}, where,
                        context.findings);
  return static_cast<size_t>(
      std::min(kMostPieces,
               decomposition->integer("max_convex_hulls", kMostPieces, Allowed::between(1, 1e6))));
}

// Lets a mesh collide as convex pieces; as the hulls of its connected parts where that fails.
void divide(Geometry& geometry, size_t most, const Element& element, const std::string& where,
            ReadContext& context) {
  try {
    geometry.pieces = context.meshes.load_pieces(geometry.mesh, most);
  } catch (const EnvironmentError&) {
    throw;
  } catch (const std::runtime_error& error) {
    context.findings.unsupported(
        element.source, where,
        std::string("the mesh cannot be divided into convex pieces: ") + error.what());
  }
}

std::optional<Geometry> read_mesh(const Element& mesh, const std::string& where,
                                  ReadContext& context, ShapeUse use) {
  report_other_children(mesh, {"uri", "scale", "submesh", "convex_decomposition"}, {}, where,
                        context.findings);
  const size_t most = most_pieces(mesh, where, context);
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
  } catch (const EnvironmentError&) {
    throw;
  } catch (const std::runtime_error& error) {
    context.findings.error(
        mesh.source, where,
        "the mesh '" + uri + "' cannot be used: " + error.what() + "; the shape is left out");
    return std::nullopt;
  }
  if (use == ShapeUse::collides_moving) divide(geometry, most, mesh, where, context);
  return geometry;
}

std::optional<Geometry> read_polyline(const Element& geometry_element, const Element& first,
                                      const std::string& where, ReadContext& context,
                                      ShapeUse use) {
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
    if (use == ShapeUse::collides_moving) divide(geometry, kMostPieces, first, where, context);
    return geometry;
  } catch (const EnvironmentError&) {
    throw;
  } catch (const std::runtime_error& error) {
    context.findings.error(
        first.source, where,
        std::string("the polyline cannot be used: ") + error.what() + "; the shape is left out");
    return std::nullopt;
  }
}

// The first <texture>'s diffuse picture, tiled over the ground. Gazebo blends in further ones by
// height; these are reported.
void cover_with_texture(const Element& element, const Vec3& size, HeightMap& mesh,
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
  ground.texture = context.textures.take(*path);
  if (!ground.texture) return;
  mesh.materials.push_back(std::move(ground));
  for (Mesh::Part& part : mesh.parts) part.material = MaterialIndex(0);
  mesh.tiles = (size.head<2>() / tile_m).cast<float>();
}

// Throws std::runtime_error that says what is wrong with the picture.
std::shared_ptr<const HeightGrid> read_heights(const Element& element, const std::string& uri,
                                               const Vec3& size, ReadContext& context) {
  const auto path = context.resources.find(uri, element.source.file);
  if (!path) throw std::runtime_error(context.resources.why_not(uri, element.source.file));
  context.documents.note(*path);
  const Vec3 at = element.vector3("pos", Vec3::Zero(), Allowed::any(quantity::kLength));
  try {
    return height_map_of(*path, size, at);
  } catch (const EnvironmentError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(std::string("cannot be used: ") + error.what());
  }
}

// A moving one collides as its hull, like a mesh.
std::shared_ptr<Mesh> mesh_of(std::shared_ptr<const HeightGrid> grid, ShapeUse use) {
  if (use == ShapeUse::collides_moving) {
    if (std::max(grid->columns(), grid->rows()) > kMostHeightsOfMoving)
      throw std::runtime_error("cannot be used: it has " + std::to_string(grid->columns()) + " x " +
                               std::to_string(grid->rows()) + " pixels; one that moves has up to " +
                               std::to_string(kMostHeightsOfMoving) + " each way");
    return std::make_shared<Mesh>(triangles_of(*grid));
  }
  auto map = std::make_shared<HeightMap>();
  const auto triangles = static_cast<uint32_t>(grid->triangle_count());
  map->parts.push_back({kHeightMapPart, 0, triangles, {}});
  map->grid = std::move(grid);
  return map;
}

std::optional<Geometry> read_heightmap(const Element& element, const std::string& where,
                                       ReadContext& context, ShapeUse use) {
  report_other_children(element, {"uri", "size", "pos", "texture"},
                        {"use_terrain_paging", "sampling", "blend"}, where, context.findings);
  const std::string uri = element.string("uri", "");
  if (uri.empty()) element.fail("has no <uri>");
  const Vec3 size = element.vector3("size", Vec3::Ones(), Allowed::any(quantity::kLength));
  if (size.minCoeff() <= 0)
    element.child("size")->fail("'" + element.child("size")->text +
                                "' is not allowed; sizes are above 0");
  std::shared_ptr<Mesh> mesh;
  try {
    mesh = mesh_of(read_heights(element, uri, size, context), use);
  } catch (const EnvironmentError&) {
    throw;
  } catch (const std::runtime_error& error) {
    element.fail("the heightmap '" + uri + "' " + error.what());
  }
  if (use == ShapeUse::seen)
    cover_with_texture(element, size, static_cast<HeightMap&>(*mesh), where, context);
  mesh->name = context.resources.find(uri, element.source.file).value_or(uri);
  Geometry geometry;
  geometry.shape = Shape::mesh;
  geometry.mesh = std::move(mesh);
  return geometry;
}

// A heightmap that collides is the ground: without it, a world is another.
template <class Read>
std::optional<Geometry> read_ground(ShapeUse use, Read read) {
  try {
    return read();
  } catch (const InputError& error) {
    if (use == ShapeUse::seen) throw;
    throw TooLarge(error.source(), error.message());
  }
}

// Checks the corners of a mesh times its scale: no number reader has checked these lengths.
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

// Reads the shapes given by a few numbers. Converters write sizes of zero for "no shape": they give
// none. Negative sizes are errors.
class SizedShape {
 public:
  SizedShape(const Element& shape, const std::string& where, Findings& findings)
      : shape_(shape), where_(where), findings_(findings) {}

  std::optional<Geometry> box() { return of_vector(Shape::box, "size", "sizes"); }
  std::optional<Geometry> ellipsoid() { return of_vector(Shape::ellipsoid, "radii", "radii"); }
  std::optional<Geometry> sphere();
  std::optional<Geometry> round(Shape kind);  // cylinder, capsule or cone
  Geometry plane();

 private:
  std::optional<Geometry> of_vector(Shape kind, const char* name, const std::string& plural);
  std::nullopt_t nothing(const char* name);
  double required(const char* name) const;
  void tell_default(const char* name, const std::string& value);

  const Element& shape_;
  const std::string& where_;
  Findings& findings_;
};

std::nullopt_t SizedShape::nothing(const char* name) {
  findings_.repaired(shape_.source, where_,
                     "a <" + shape_.name + "> whose <" + name + "> is 0; the shape is left out");
  return std::nullopt;
}

double SizedShape::required(const char* name) const {
  if (!shape_.has(name)) shape_.fail(std::string("has no <") + name + ">");
  return shape_.number(name, 0, Allowed::not_negative(quantity::kLength));
}

// Where SDF has a default, a file may omit the value.
void SizedShape::tell_default(const char* name, const std::string& value) {
  if (shape_.has(name)) return;
  findings_.repaired(shape_.source, where_,
                     "a <" + shape_.name + "> without <" + name + ">; it is " + value +
                         " as in SDF's description");
}

std::optional<Geometry> SizedShape::of_vector(Shape kind, const char* name,
                                              const std::string& plural) {
  Geometry g;
  g.shape = kind;
  tell_default(name, "1 1 1");
  g.size = shape_.vector3(name, Vec3::Ones(), Allowed::any(quantity::kLength));
  if (g.size.minCoeff() < 0)
    shape_.child(name)->fail("'" + shape_.child(name)->text + "' is not allowed; " + plural +
                             " are above 0");
  if (g.size.minCoeff() == 0) return nothing(name);
  return g;
}

std::optional<Geometry> SizedShape::sphere() {
  Geometry g;
  g.shape = Shape::sphere;
  tell_default("radius", "1");
  g.size = Vec3::Constant(shape_.number("radius", 1, Allowed::not_negative(quantity::kLength)));
  if (g.size.x() == 0) return nothing("radius");
  return g;
}

std::optional<Geometry> SizedShape::round(Shape kind) {
  Geometry g;
  g.shape = kind;
  const double radius = required("radius");
  g.size = {radius, required("length"), 0};
  if (g.size.x() == 0) return nothing("radius");
  if (g.size.y() == 0 && kind != Shape::capsule) return nothing("length");
  return g;
}

Geometry SizedShape::plane() {
  Geometry g;
  g.shape = Shape::plane;
  const Vec3 normal = shape_.vector3("normal", Vec3::UnitZ(), Allowed::any(quantity::kFactor));
  if (!(normal.norm() > 1e-9))
    shape_.child("normal")->fail("'" + shape_.child("normal")->text +
                                 "' is not allowed; a normal is not zero");
  g.normal = normal.normalized();
  const Element* size = shape_.child("size");
  if (!size) return g;
  std::vector<double> v = size->as_numbers(Allowed::any(quantity::kLength));
  if (v.size() == 3) {  // <size> of a box, which some files write here
    findings_.repaired(size->source, where_,
                       "<size> of a plane has two numbers; the third is left out");
    v.pop_back();
  }
  if (v.size() != 2 || v[0] <= 0 || v[1] <= 0)
    size->fail("'" + size->text + "' is not allowed; allowed are two numbers above 0");
  g.extent = {v[0], v[1]};
  return g;
}

// The one shape of a <geometry>; nullptr: without one, or for <empty/>.
const Element* shape_of(const Element& element) {
  const Element* shape = nullptr;
  for (const auto& child : element.children) {
    if (child->name == "empty") return nullptr;
    if (child->name.find(':') != std::string::npos)
      child->fail("is not allowed here; <geometry> has no elements of ruedo:");
    if (shape && child->name != "polyline") child->fail("is a second shape; <geometry> holds one");
    if (!shape) shape = child.get();
  }
  return shape;
}

}  // namespace

std::optional<Geometry> read_geometry(const Element& element, const std::string& where,
                                      ReadContext& context, ShapeUse use) {
  const Element* shape = shape_of(element);
  if (!shape) return std::nullopt;
  const auto unless_too_large = [&](std::optional<Geometry> g) -> std::optional<Geometry> {
    if (!g || is_too_large(*g, *shape, where, context)) return std::nullopt;
    context.triangles.add(g->mesh, g->scale, *shape);
    return g;
  };
  const std::string& kind = shape->name;
  SizedShape sized(*shape, where, context.findings);
  if (kind == "box") return sized.box();
  if (kind == "sphere") return sized.sphere();
  if (kind == "cylinder") return sized.round(Shape::cylinder);
  if (kind == "capsule") return sized.round(Shape::capsule);
  if (kind == "cone") return sized.round(Shape::cone);
  if (kind == "ellipsoid") return sized.ellipsoid();
  if (kind == "plane") return sized.plane();
  if (kind == "mesh") return unless_too_large(read_mesh(*shape, where, context, use));
  if (kind == "polyline")
    return unless_too_large(read_polyline(element, *shape, where, context, use));
  if (kind == "heightmap") {
    return unless_too_large(
        read_ground(use, [&] { return read_heightmap(*shape, where, context, use); }));
  }
  const std::string near =
      nearest_word(kind, {"box", "sphere", "cylinder", "capsule", "cone", "ellipsoid", "plane",
                          "mesh", "polyline", "heightmap"});
  context.findings.error(shape->source, where,
                         "the shape <" + kind + "> is not supported and left out" +
                             (near.empty() ? "" : "; did you mean <" + near + ">?"));
  return std::nullopt;
}

}  // namespace ruedo::world
