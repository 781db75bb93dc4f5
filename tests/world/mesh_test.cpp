// Meshes: every format with its unit and up axis, the importer's faults and limits, the cache, and
// the shapes that are made here.
#include <chrono>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "world/load.h"
#include "world/mesh/codecs.h"
#include "world/mesh/mesh_format.h"
#include "world/mesh/mesh_loader.h"
#include "world/mesh/picture.h"
#include "world/read/geometry.h"
#include "world/read/height_maps.h"

namespace ruedo::world {
namespace {

// A box of 1 x 2 x 3 m with a corner at the origin, in +x, +y, +z: no two axes can be mistaken.
constexpr float kCorners[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {0, 2, 0},
                                  {0, 0, 3}, {1, 0, 3}, {1, 2, 3}, {0, 2, 3}};
constexpr int kFaces[12][3] = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                               {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};

std::string numbers(const float* p) {
  return std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]);
}

std::string obj() {
  std::string text = "mtllib box.mtl\nusemtl red\n";
  for (const auto& c : kCorners) text += "v " + numbers(c) + "\n";
  for (const auto& f : kFaces)
    text += "f " + std::to_string(f[0] + 1) + " " + std::to_string(f[1] + 1) + " " +
            std::to_string(f[2] + 1) + "\n";
  return text;
}

std::string stl() {
  std::string text = "solid box\n";
  for (const auto& f : kFaces) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int i : f) text += "vertex " + numbers(kCorners[i]) + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid box\n";
}

std::string ply() {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float "
      "z\n"
      "element face 12\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& c : kCorners) text += numbers(c) + "\n";
  for (const auto& f : kFaces)
    text += "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) +
            "\n";
  return text;
}

// COLLADA in a unit of `meter`, with two nodes: the box, and it again 10 m further in x.
std::string dae(const std::string& meter, const std::string& up, float scale) {
  std::string positions, indices;
  for (const auto& c : kCorners) {
    const float p[3] = {c[0] * scale, c[1] * scale, c[2] * scale};
    positions += numbers(p) + " ";
  }
  for (const auto& f : kFaces)
    indices += std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) + " ";
  return "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' "
         "version='1.4.1'><asset><unit meter='" +
         meter + "'/><up_axis>" + up +
         "</up_axis></asset><library_geometries><geometry id='g' name='box'><mesh><source "
         "id='p'><float_array id='pa' count='24'>" +
         positions +
         "</float_array><technique_common><accessor source='#pa' count='8' stride='3'><param "
         "name='X' type='float'/><param name='Y' "
         "type='float'/><param name='Z' "
         "type='float'/></accessor></technique_common></source><vertices id='v'><input "
         "semantic='POSITION' "
         "source='#p'/></vertices><triangles count='12'><input semantic='VERTEX' source='#v' "
         "offset='0'/><p>" +
         indices +
         "</p></triangles></mesh></geometry></"
         "library_geometries><library_visual_scenes><visual_scene id='s'>"
         "<node id='n1' name='near'><instance_geometry url='#g'/></node>"
         "<node id='n2' name='far'><translate>" +
         std::to_string(10 * scale) +
         " 0 0</translate><instance_geometry url='#g'/></node>"
         "</visual_scene></library_visual_scenes><scene><instance_visual_scene "
         "url='#s'/></scene></COLLADA>";
}

// The box in glTF's axes (y up): our (x, y, z) is glTF's (x, z, -y).
std::string gltf_buffer() {
  std::string bytes;
  for (const auto& c : kCorners) {
    const float p[3] = {c[0], c[2], -c[1]};
    bytes.append(reinterpret_cast<const char*>(p), sizeof p);
  }
  for (const auto& f : kFaces) {
    for (const int i : f) {
      const uint16_t index = static_cast<uint16_t>(i);
      bytes.append(reinterpret_cast<const char*>(&index), 2);
    }
  }
  return bytes;
}
std::string gltf_json(const std::string& buffer) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"name":"box","mesh":0}],)"
         R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{)" +
         buffer +
         R"("byteLength":168}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":72}],)"
         R"("accessors":[{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3","min":[0,0,-2],"max":[1,3,0]},)"
         R"({"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"}]})";
}
std::string glb() {
  std::string json = gltf_json(""), buffer = gltf_buffer(), out = "glTF";
  while (json.size() % 4) json += ' ';
  const auto u32 = [&](uint32_t v) { out.append(reinterpret_cast<const char*>(&v), 4); };
  u32(2);
  u32(static_cast<uint32_t>(12 + 8 + json.size() + 8 + buffer.size()));
  u32(static_cast<uint32_t>(json.size()));
  out += "JSON" + json;
  u32(static_cast<uint32_t>(buffer.size()));
  out.append("BIN\0", 4);
  return out + buffer;
}

std::string chunk_3ds(uint16_t id, const std::string& body) {
  const uint32_t size = static_cast<uint32_t>(body.size() + 6);
  std::string out(reinterpret_cast<const char*>(&id), 2);
  out.append(reinterpret_cast<const char*>(&size), 4);
  return out + body;
}
std::string three_ds() {
  std::string vertices("\x08\x00", 2), faces("\x0c\x00", 2);
  for (const auto& c : kCorners) vertices.append(reinterpret_cast<const char*>(c), 12);
  for (const auto& f : kFaces) {
    for (const int i : f) {
      const uint16_t index = static_cast<uint16_t>(i);
      faces.append(reinterpret_cast<const char*>(&index), 2);
    }
    faces.append("\x07\x00", 2);
  }
  const std::string mesh =
      chunk_3ds(0x4100, chunk_3ds(0x4110, vertices) + chunk_3ds(0x4120, faces));
  return chunk_3ds(0x4D4D, chunk_3ds(0x3D3D, chunk_3ds(0x4000, std::string("box\0", 4) + mesh)));
}

// ASCII FBX: up axis 1 is y, 2 is z; unit: centimetres in one unit.
std::string fbx(int up, double unit) {
  std::string vertices, indices;
  for (const auto& c : kCorners) {
    const double s = 100.0 / unit;  // file units in a metre
    const double p[3] = {c[0] * s, up == 1 ? c[2] * s : c[1] * s, up == 1 ? -c[1] * s : c[2] * s};
    for (const double v : p) vertices += (vertices.empty() ? "" : ",") + std::to_string(v);
  }
  for (const auto& f : kFaces) {
    indices += (indices.empty() ? "" : ",") + std::to_string(f[0]) + "," + std::to_string(f[1]) +
               "," + std::to_string(-f[2] - 1);
  }
  return "; FBX 7.3.0 project file\nFBXHeaderExtension:  {\n\tFBXHeaderVersion: "
         "1003\n\tFBXVersion: 7300\n}\nGlobalSettings:  {\n\tVersion: 1000\n"
         "\tProperties70:  {\n\t\tP: \"UpAxis\", \"int\", \"Integer\", \"\"," +
         std::to_string(up) +
         "\n\t\tP: \"UpAxisSign\", \"int\", \"Integer\", \"\",1\n\t\tP: \"FrontAxis\", \"int\", "
         "\"Integer\", \"\"," +
         std::to_string(up == 1 ? 2 : 1) +
         "\n\t\tP: \"FrontAxisSign\", \"int\", \"Integer\", \"\"," +
         std::string(up == 1 ? "1" : "-1") +
         "\n\t\tP: \"CoordAxis\", \"int\", \"Integer\", \"\",0\n\t\tP: \"CoordAxisSign\", \"int\", "
         "\"Integer\", \"\",1\n"
         "\t\tP: \"UnitScaleFactor\", \"double\", \"Number\", \"\"," +
         std::to_string(unit) +
         "\n\t}\n}\n"
         "Objects:  {\n\tGeometry: 1000, \"Geometry::box\", \"Mesh\" {\n\t\tVertices: *24 "
         "{\n\t\t\ta: " +
         vertices + "\n\t\t}\n\t\tPolygonVertexIndex: *36 {\n\t\t\ta: " + indices +
         "\n\t\t}\n\t\tGeometryVersion: 124\n\t}\n"
         "\tModel: 2000, \"Model::box\", \"Mesh\" {\n\t\tVersion: 232\n\t}\n}\nConnections:  "
         "{\n\tC: \"OO\",2000,0\n\tC: \"OO\",1000,2000\n}\n";
}

class Meshes : public testing::Test {
 protected:
  MeshImport import() const {
    MeshImport import;
    import.importer = std::string(RUEDO_BINARY_DIR) + "/bin/ruedo-import-mesh";
    import.cache_folder = folder / "cache";
    return import;
  }
  static Eigen::AlignedBox3f box_of(const Mesh& mesh) {
    Eigen::AlignedBox3f box;
    for (const auto& p : mesh.positions) box.extend(p);
    return box;
  }
  // Six times the volume, positive when the triangles run counter-clockwise seen from outside.
  static double volume(const Mesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles) {
      const Vec3 a = mesh.positions[t[0]].cast<double>(), b = mesh.positions[t[1]].cast<double>(),
                 c = mesh.positions[t[2]].cast<double>();
      sum += a.dot(b.cross(c)) / 6;
    }
    return sum;
  }
  std::string fault_of(const std::string& path, const MeshImport& settings) const {
    const ResourceFinder finder(path, true);
    MeshLoader loader(finder, textures, settings);
    try {
      loader.load(path);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
  TemporaryFolder folder;
  mutable Findings findings;
  mutable TextureStore textures{findings};
};

TEST_F(Meshes, EveryFormatGivesTheSameBox) {
  folder.write("box.mtl", "newmtl red\nKd 0.8 0.1 0.2\n");
  folder.write("box.bin", gltf_buffer());
  const std::pair<std::string, std::string> files[] = {
      {"box.obj", obj()},        {"box.stl", stl()},
      {"box.ply", ply()},        {"box.gltf", gltf_json("\"uri\":\"box.bin\",")},
      {"box.glb", glb()},        {"box.3ds", three_ds()},
      {"zup_cm.fbx", fbx(2, 1)}, {"yup_cm.fbx", fbx(1, 1)},
      {"zup_m.fbx", fbx(2, 100)}};
  for (const auto& [name, content] : files) {
    const std::string path = folder.write(name, content);
    const ResourceFinder finder(path, true);
    MeshLoader loader(finder, textures, import());
    SCOPED_TRACE(name);
    std::shared_ptr<const Mesh> mesh;
    ASSERT_NO_THROW(mesh = loader.load(path));
    EXPECT_LT((box_of(*mesh).min() - Eigen::Vector3f(0, 0, 0)).norm(), 1e-5f)
        << box_of(*mesh).min().transpose();
    EXPECT_LT((box_of(*mesh).max() - Eigen::Vector3f(1, 2, 3)).norm(), 1e-5f)
        << box_of(*mesh).max().transpose();
    EXPECT_EQ(mesh->triangles.size(), 12u);
    EXPECT_NEAR(volume(*mesh), 6.0, 1e-4);
    EXPECT_TRUE(mesh->closed);
  }
}

// COLLADA's unit counts; its up axis does not, as in Gazebo.
TEST_F(Meshes, ColladaUnitsAndNodes) {
  for (const char* up : {"Z_UP", "Y_UP"}) {
    const std::string path = folder.write(std::string(up) + ".dae", dae("0.0254", up, 1 / 0.0254f));
    const ResourceFinder finder(path, true);
    MeshLoader loader(finder, textures, import());
    const auto mesh = loader.load(path);
    EXPECT_LT((box_of(*mesh).max() - Eigen::Vector3f(11, 2, 3)).norm(), 1e-4f)
        << up << " " << box_of(*mesh).max().transpose();
    const auto far = loader.load_submesh(path, "far", false);
    EXPECT_LT((box_of(*far).min() - Eigen::Vector3f(10, 0, 0)).norm(), 1e-4f);
    EXPECT_TRUE(far->closed);
    EXPECT_EQ(far->triangles.size(), 12u);
    const auto centred = loader.load_submesh(path, "far", true);
    EXPECT_LT((box_of(*centred).max() - Eigen::Vector3f(0.5, 1, 1.5)).norm(), 1e-4f);
    try {
      loader.load_submesh(path, "middle", false);
      FAIL();
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "it has no submesh 'middle'; there are near, far");
    }
  }
}

TEST_F(Meshes, MaterialsAndTheirFile) {
  folder.write("box.mtl", "newmtl red\nKd 0.8 0.1 0.2\nmap_Kd paint.png\n");
  folder.write("textures/paint.png", "not decoded here");
  const std::string path = folder.write("box.obj", obj());
  const ResourceFinder finder(path, true);
  MeshLoader loader(finder, textures, import());
  const auto mesh = loader.load(path);
  ASSERT_EQ(mesh->parts.size(), 1u);
  const Material& material = mesh->materials.at(static_cast<size_t>(mesh->parts[0].material));
  EXPECT_FLOAT_EQ(material.diffuse[0], 0.8f);
  ASSERT_TRUE(material.texture);
  EXPECT_EQ(material.texture->path, folder / "textures/paint.png");
  // The cache knows that the mesh depends on its material file.
  folder.write("box.mtl", "newmtl red\nKd 0.3 0.1 0.2\n");
  MeshLoader again(finder, textures, import());
  const auto changed = again.load(path);
  EXPECT_FLOAT_EQ(changed->materials.at(static_cast<size_t>(changed->parts[0].material)).diffuse[0],
                  0.3f);
}

// Once, where a picture would have been seen.
TEST_F(Meshes, WarnsAboutMissingTextures) {
  folder.write("box.mtl", "newmtl red\nKd 0.8 0.1 0.2\nmap_Kd paint.png\n");
  const std::string path = folder.write("box.obj", obj());
  const std::string box = "<geometry><mesh><uri>box.obj</uri></mesh></geometry>";
  const auto named = [&](const std::string& shapes) {
    const auto world = load_world_text(
        "<sdf version='1.9'><model name='m'><link name='l'>" + shapes + "</link></model></sdf>",
        folder / "m.sdf");
    std::vector<std::string> list;
    for (const Finding& each : world->findings)
      list.push_back(each.source.str() + ": " + each.text);
    return list;
  };
  EXPECT_EQ(named("<visual name='a'>" + box + "</visual><visual name='b'>" + box + "</visual>"),
            std::vector{path + ": the texture 'paint.png' is not found; the plain colour is shown "
                               "instead"});
  EXPECT_TRUE(named("<collision name='a'>" + box + "</collision><visual name='b'>" + box +
                    "<material><diffuse>1 0 0 1</diffuse></material></visual>")
                  .empty());
}

TEST_F(Meshes, CacheIsUsedAndABrokenEntryIsNot) {
  const std::string path = folder.write("box.stl", stl());
  EXPECT_EQ(fault_of(path, import()), "");
  MeshImport none = import();
  none.importer = "/nowhere/importer";
  EXPECT_EQ(fault_of(path, none), "") << "the entry was not used";
  std::string entry;
  for (const auto& each : std::filesystem::directory_iterator(folder / "cache"))
    entry = each.path().string();
  ASSERT_FALSE(entry.empty());
  std::string bytes;
  {
    std::ifstream in(entry, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  for (size_t at = 0; at < bytes.size(); at += 97) {
    std::string broken = bytes;
    broken[at] = static_cast<char>(broken[at] ^ 0x20);
    std::ofstream(entry, std::ios::binary) << broken;
    EXPECT_EQ(fault_of(path, none), "the importer of meshes, /nowhere/importer, cannot be run")
        << "byte " << at;
  }
  std::ofstream(entry, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  EXPECT_EQ(fault_of(path, none), "the importer of meshes, /nowhere/importer, cannot be run");
  EXPECT_EQ(fault_of(path, import()), "");  // imported again
  EXPECT_EQ(fault_of(path, none), "");      // and replaced
}

// An angle of two plates, 3 x 3 x 1 m with a corner of 2 x 2 m cut out, is two pieces.
TEST_F(Meshes, PiecesAreCached) {
  std::string angle;
  for (const char* z : {" 0\n", " 1\n"}) {
    for (const char* xy : {"0 0", "3 0", "3 1", "1 1", "1 3", "0 3"})
      angle += std::string("v ") + xy + z;
  }
  angle += "f 4 3 2\nf 4 2 1\nf 4 1 6\nf 4 6 5\nf 8 9 10\nf 7 8 10\nf 12 7 10\nf 11 12 10\n";
  for (int k = 0; k < 6; ++k) {
    const std::string from = std::to_string(k + 1), to = std::to_string((k + 1) % 6 + 1),
                      over = std::to_string((k + 1) % 6 + 7), up = std::to_string(k + 7);
    angle += "f " + from + ' ' + to + ' ' + over + "\nf " + from + ' ' + over + ' ' + up + '\n';
  }
  const std::string path = folder.write("angle.obj", angle), box = folder.write("box.stl", stl());
  const auto pieces_of = [&](const std::string& file, const MeshImport& settings) {
    const ResourceFinder finder(file, true);
    MeshLoader loader(finder, textures, settings);
    return loader.load_pieces(loader.load(file), 64);
  };
  const auto pieces = pieces_of(path, import());
  ASSERT_TRUE(pieces);
  ASSERT_EQ(pieces->parts.size(), 2u);
  EXPECT_NEAR(volume(*pieces), 5.0, 1e-3);
  EXPECT_FALSE(pieces_of(box, import())) << "a box needs no pieces";
  MeshImport none = import(), uncached = import();
  none.importer = "/nowhere/importer";
  uncached.cache = false;
  for (const MeshImport& settings : {none, uncached}) {
    const auto again = pieces_of(path, settings);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->positions, pieces->positions);
    EXPECT_EQ(again->triangles, pieces->triangles);
  }
  EXPECT_FALSE(pieces_of(box, none));
}

TEST_F(Meshes, ImportersThatFailDoNotHarmUs) {
  const std::string path = folder.write("box.stl", stl());
  const auto fake = [&](const std::string& name, const std::string& script) {
    MeshImport settings = import();
    settings.importer = folder.write(name, "#!/bin/sh\n" + script + "\n");
    std::filesystem::permissions(settings.importer, std::filesystem::perms::owner_all);
    settings.wall_limit_s = 2;
    settings.cpu_limit_s = 1;
    return settings;
  };
  EXPECT_EQ(fault_of(path, fake("hang", "sleep 100")), "the importer took longer than 2 s");
  EXPECT_EQ(fault_of(path, fake("abort", "kill -ABRT $$")),
            "the importer died of signal 6; the file is malformed");
  MeshImport spin = fake("spin", "while :; do :; done");
  spin.wall_limit_s = 100;
  EXPECT_EQ(fault_of(path, spin), "the importer needed more than 1 s of CPU time");
  EXPECT_EQ(fault_of(path, fake("says", "echo 'line 3: bad' >&2; exit 1")), "line 3: bad");
  EXPECT_EQ(fault_of(path, fake("quiet", "exit 3")), "the importer failed");
  EXPECT_EQ(fault_of(path, fake("nothing", "exit 0")), "it ends too early");
  EXPECT_EQ(fault_of(path, fake("lies", "echo garbage garbage")), "its check sum is wrong");
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST_F(Meshes, ImporterThatEatsMemoryIsStopped) {
  std::string huge = "solid s\n";
  for (int i = 0; i < 200'000; ++i)
    huge += "facet normal 0 0 0\nouter loop\nvertex 0 0 " + std::to_string(i) +
            "\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  const std::string path = folder.write("huge.stl", huge + "endsolid s\n");
  MeshImport settings = import();
  settings.memory_limit_bytes = size_t{90} << 20;
  EXPECT_NE(fault_of(path, settings), "");
  std::string many = ply();
  many.replace(many.find("element vertex ") + 15, 0, "99999999");
  EXPECT_EQ(fault_of(folder.write("many.ply", many), import()),
            "importing its 0.0 MB needs more than the 3.0 GiB of memory that an importer may use; "
            "reduce it to about 2 000 000 triangles, or split it into several files");
}
#endif

TEST_F(Meshes, MalformedFilesAreFaults) {
  EXPECT_NE(fault_of(folder.write("empty.obj", ""), import()), "");
  EXPECT_NE(fault_of(folder.write("text.dae", "hello"), import()), "");
  EXPECT_NE(fault_of(folder.write("text.glb", "hello"), import()), "");
  EXPECT_EQ(
      fault_of(folder.write("box.blend", "hello"), import()),
      "'.blend' is not a known kind of mesh; known are obj, dae, stl, ply, gltf, glb, 3ds, fbx");
  std::string far = stl();
  far.replace(far.find("vertex 0.0"), 15, "vertex 1e30 0 0");
  EXPECT_NE(fault_of(folder.write("far.stl", far), import()), "");
  // A truncated file is a mesh or a fault, nothing else. This one, truncated in its header, keeps
  // assimp busy for ever.
  MeshImport impatient = import();
  impatient.cpu_limit_s = 1;
  EXPECT_NE(fault_of(folder.write("cut.ply", ply().substr(0, 151)), impatient), "");
  EXPECT_NE(fault_of(folder.write("half.ply", ply().substr(0, 302)), impatient), "");
}

TEST(MeshFormat, RefusesInconsistentMeshes) {
  MeshPackage package;
  package.mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  package.mesh.triangles = {{0, 1, 2}};
  package.mesh.parts.push_back({"p", 0, 1, {}});
  EXPECT_NO_THROW(unpack_mesh(pack_mesh(package)));
  const auto fault = [&](auto change) {
    MeshPackage bad = package;
    change(bad.mesh);
    try {
      unpack_mesh(pack_mesh(bad));
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(fault([](Mesh& m) { m.triangles[0][2] = 3; }),
            "a triangle names a vertex that is not there");
  EXPECT_EQ(fault([](Mesh& m) { m.positions[1].x() = NAN; }), "it has a vertex that is not finite");
  EXPECT_EQ(fault([](Mesh& m) { m.positions[1].x() = 2e6f; }), "it reaches beyond 1000 km");
  EXPECT_EQ(fault([](Mesh& m) { m.normals.resize(2); }), "it has not one normal per vertex");
  EXPECT_EQ(fault([](Mesh& m) { m.parts[0].triangle_count = 2; }),
            "a part names triangles that are not there");
  EXPECT_EQ(fault([](Mesh& m) { m.parts[0].material = world::MaterialIndex(0); }),
            "a part names a material that is not there");
  EXPECT_EQ(fault([](Mesh& m) {
              m.triangles.clear();
              m.parts.clear();
            }),
            "it has no triangles");
}

TEST(MadeMeshes, SquareWithAHole) {
  const std::vector<Eigen::Vector2d> outer = {{0, 0}, {4, 0}, {4, 4}, {0, 4}},
                                     hole = {{1, 1}, {3, 1}, {3, 3}, {1, 3}};
  const Mesh mesh = extruded({outer, hole}, 2.0);
  double volume = 0;
  for (const auto& t : mesh.triangles) {
    volume += mesh.positions[t[0]].cast<double>().dot(
                  mesh.positions[t[1]].cast<double>().cross(mesh.positions[t[2]].cast<double>())) /
              6;
  }
  EXPECT_NEAR(volume, (16 - 4) * 2, 1e-5);
  EXPECT_THROW(extruded({{{0, 0}, {1, 1}, {1, 0}, {0, 1}}}, 1),
               std::runtime_error);  // crosses itself
  EXPECT_THROW(extruded({{{0, 0}, {1, 1}}}, 1), std::runtime_error);
}

TEST(MadeMeshes, ConcavePolygonIsClosed) {
  const Mesh mesh =
      extruded({{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}}, 1.0);  // an L of area 3
  double volume = 0;
  for (const auto& t : mesh.triangles) {
    volume += mesh.positions[t[0]].cast<double>().dot(
                  mesh.positions[t[1]].cast<double>().cross(mesh.positions[t[2]].cast<double>())) /
              6;
  }
  EXPECT_NEAR(volume, 3, 1e-6);
  EXPECT_TRUE(mesh.closed);
}

TEST(MadeMeshes, HeightmapOfTwoByTwo) {
  TemporaryFolder folder;
  // A portable grey map: heights 0, 255 / 0, 51; the first row is at +y.
  const std::string path =
      folder.write("h.pgm", std::string("P5\n2 2\n255\n") + std::string("\x00\xff\x00\x33", 4));
  const Mesh mesh = triangles_of(heightmap(path, {4, 6, 10}));
  ASSERT_EQ(mesh.positions.size(), 4u);
  EXPECT_TRUE(mesh.positions[1].isApprox(Eigen::Vector3f(2, 3, 10)));
  EXPECT_TRUE(mesh.positions[3].isApprox(Eigen::Vector3f(2, -3, 2)));
  for (const auto& t : mesh.triangles) {
    EXPECT_GT((mesh.positions[t[1]] - mesh.positions[t[0]])
                  .cross(mesh.positions[t[2]] - mesh.positions[t[0]])
                  .z(),
              0);
  }
  EXPECT_THROW(heightmap(folder.write("x.png", "no picture"), {1, 1, 1}), std::runtime_error);
}

// A digital elevation model: metres above the sea, from its lowest to its highest point.
TEST(MadeMeshes, HeightmapOfElevations) {
  TemporaryFolder folder;
  cv::Mat elevation(2, 2, CV_32F);
  elevation.at<float>(0, 0) = 100.0f;
  elevation.at<float>(0, 1) = 140.0f;
  elevation.at<float>(1, 0) = -9999.0f;  // not measured
  elevation.at<float>(1, 1) = 110.0f;
  std::vector<uint8_t> bytes;
  encode_picture(".tiff", elevation, bytes, {});
  const HeightGrid grid =
      heightmap(folder.write("dem.tif", std::string(bytes.begin(), bytes.end())), {4, 6, 8});
  const double heights[] = {0.0, 8.0, 0.0, 2.0};
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(grid.vertex(i).z(), heights[i], 1e-5) << i;
}

// 513 x 257 of 16 bits, about a place of its own: each pixel is where SDF says.
TEST(MadeMeshes, HeightmapsNeedNotBeSquare) {
  const TemporaryFolder folder;
  cv::Mat numbers(257, 513, CV_16U);
  const auto number = [](int row, int column) { return (7919 * row + 104729 * column) % 65536; };
  for (int row = 0; row < 257; ++row)
    for (int column = 0; column < 513; ++column)
      numbers.at<uint16_t>(row, column) = static_cast<uint16_t>(number(row, column));
  std::vector<uint8_t> bytes;
  encode_picture(".png", numbers, bytes, {});
  const HeightGrid grid = heightmap(folder.write("a.png", std::string(bytes.begin(), bytes.end())),
                                    {51.2, 25.6, 10}, {3, 4, -5});
  ASSERT_EQ(grid.columns(), 513u);
  ASSERT_EQ(grid.rows(), 257u);
  for (int row = 0; row < 257; row += 16) {
    for (int column = 0; column < 513; column += 19) {
      const Vec3 expected(-25.6 + 0.1 * column + 3, 12.8 - 0.1 * row + 4,
                          number(row, column) / 65535.0 * 10 - 5);
      EXPECT_LT((grid.vertex(row, column).cast<double>() - expected).norm(), 1e-5);
    }
  }
}

// A few bytes that announce gigabytes: the header is checked before anything is decoded.
TEST(Pictures, TooLargeByTheirHeads) {
  const std::string big("\x00\x00\xEA\x60", 4), small("\x00\x00\x00\x10", 4);  // 60000 and 16
  const auto png = [](const std::string& w, const std::string& h) {
    return std::string("\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", 16) + w + h;
  };
  EXPECT_EQ(picture_fault(png(big, small), 1000),
            "it has 60000 x 16 pixels; allowed are 1000 each way");
  EXPECT_EQ(picture_fault(png(small, big), 1000),
            "it has 16 x 60000 pixels; allowed are 1000 each way");
  EXPECT_EQ(picture_fault(png(small, small), 1000), "");
  const std::string jpeg = std::string(
                               "\xFF\xD8\xFF\xE0\x00\x04"
                               "ab"
                               "\xFF\xC0\x00\x11\x08",
                               13) +
                           "\xEA\x60" + std::string("\x00\x10\x03", 3);
  EXPECT_EQ(picture_fault(jpeg, 1000), "it has 16 x 60000 pixels; allowed are 1000 each way");
  EXPECT_EQ(picture_fault(std::string("P5 # wide\n60000\n16 255\n"), 1000),
            "it has 60000 x 16 pixels; allowed are 1000 each way");
  std::string bmp(30, '\0');
  bmp.replace(0, 2, "BM")
      .replace(18, 4, std::string("\x10\0\0\0", 4))
      .replace(22, 4, std::string("\xA0\x15\xFF\xFF", 4));  // -60000: from the top
  EXPECT_EQ(picture_fault(bmp, 1000), "it has 16 x 60000 pixels; allowed are 1000 each way");
  EXPECT_EQ(picture_fault(std::string("hello"), 1000),
            "it is not a picture that can be read (pgm, png, jpeg, bmp, tiff)");
}

// A decoder takes the bytes of a portable map as they are: white would be grey.
TEST(Pictures, OfAnotherWhiteAreRefused) {
  const std::string wanted = "; allowed are 255 and 65535: save it with one of these";
  const auto fault = [](const std::string& head) { return picture_fault(head + " ", 1000); };
  EXPECT_EQ(fault("P5 4 4 100"), "its white is 100" + wanted);
  EXPECT_EQ(fault("P6\n4 4\n# twelve bits\n4095"), "its white is 4095" + wanted);
  EXPECT_EQ(fault("P2 4 4 1000"), "its white is 1000" + wanted);
  for (const char* good : {"P5 4 4 255", "P5 4 4 65535", "P6 4 4 255", "P4 4 4", "P1 4 4",
                           "P2 4 4 15", "P3 4 4 65535"})  // texts of up to 255 are scaled
    EXPECT_EQ(fault(good), "");
}

}  // namespace
}  // namespace ruedo::world
