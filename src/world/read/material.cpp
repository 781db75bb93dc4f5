// <material>, Gazebo's colour table, and a reader for simple OGRE material scripts.
#include "world/read/material.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <sstream>

#include "base/input_file.h"

namespace fs = std::filesystem;

namespace ruedo::world {
namespace {

struct NamedColour {
  const char* name;
  float r, g, b;
};

// Diffuse colours of Gazebo's material library; for textured materials, the mean colour of the
// texture.
constexpr NamedColour kGazeboColours[] = {
    {"Grey", 0.7f, 0.7f, 0.7f},
    {"LightGrey", 0.8f, 0.8f, 0.8f},
    {"DarkGrey", 0.175f, 0.175f, 0.175f},
    {"White", 1, 1, 1},
    {"Black", 0, 0, 0},
    {"FlatBlack", 0.1f, 0.1f, 0.1f},
    {"Red", 1, 0, 0},
    {"RedBright", 0.87f, 0.26f, 0.07f},
    {"Green", 0, 1, 0},
    {"Blue", 0, 0, 1},
    {"SkyBlue", 0.13f, 0.44f, 0.70f},
    {"Yellow", 1, 1, 0},
    {"ZincYellow", 0.97f, 0.95f, 0.21f},
    {"DarkYellow", 0.7f, 0.7f, 0},
    {"Purple", 1, 0, 1},
    {"Turquoise", 0, 1, 1},
    {"Orange", 1, 0.51f, 0.05f},
    {"DarkOrange", 0.9f, 0.4f, 0},
    {"Indigo", 0.33f, 0, 0.5f},
    {"Gold", 0.8f, 0.65f, 0.1f},
    {"Bronze", 0.71f, 0.43f, 0.18f},
    {"DarkMagenta", 0.55f, 0, 0.55f},
    {"BlueLaser", 0, 0, 1},
    {"Wood", 0.66f, 0.48f, 0.3f},
    {"WoodFloor", 0.6f, 0.42f, 0.25f},
    {"WoodPallet", 0.7f, 0.58f, 0.42f},
    {"WoodTile", 0.62f, 0.45f, 0.3f},
    {"Bricks", 0.6f, 0.32f, 0.25f},
    {"PaintedWall", 0.85f, 0.84f, 0.8f},
    {"CeilingTiled", 0.85f, 0.85f, 0.85f},
    {"Road", 0.3f, 0.3f, 0.3f},
    {"Residential", 0.35f, 0.35f, 0.35f},
    {"Motorway", 0.35f, 0.35f, 0.35f},
    {"Pedestrian", 0.5f, 0.5f, 0.5f},
    {"Asphalt", 0.3f, 0.3f, 0.3f},
    {"Grass", 0.3f, 0.45f, 0.2f},
    {"GrassFloor", 0.3f, 0.45f, 0.2f},
    {"Gravel", 0.5f, 0.48f, 0.45f},
    {"Mud", 0.4f, 0.3f, 0.2f},
    {"Rockwall", 0.5f, 0.47f, 0.43f},
    {"Steel", 0.6f, 0.6f, 0.62f},
    {"Chrome", 0.75f, 0.75f, 0.78f},
    {"CloudySky", 0.7f, 0.75f, 0.85f},
    {"OrangeRed", 1, 0.27f, 0},
    {"Tan", 0.82f, 0.71f, 0.55f},
    {"Cyan", 0, 1, 1},
    {"Fish", 0.6f, 0.6f, 0.5f},
    {"PioneerBody", 0.7f, 0, 0},
    {"ShippingContainer", 0.55f, 0.25f, 0.2f},
    {"CardboardBox", 0.72f, 0.57f, 0.4f},
};

bool strip_suffix(std::string& text, const std::string& suffix) {
  if (text.size() <= suffix.size() ||
      text.compare(text.size() - suffix.size(), suffix.size(), suffix) != 0)
    return false;
  text.resize(text.size() - suffix.size());
  return true;
}

// OGRE's script: "material NAME { technique { pass { diffuse r g b a ... texture_unit { texture
// FILE ... } } } }", one statement per line, // for comments. Only the first pass is read;
// inheritance and shaders are not supported.
struct OgreMaterial {
  Material material;
  std::string texture;
};

std::optional<OgreMaterial> read_ogre_script(const std::string& script, const std::string& wanted) {
  std::istringstream lines(script);
  std::optional<OgreMaterial> result;
  int depth = 0, passes = 0;
  for (std::string line; std::getline(lines, line);) {
    if (const size_t comment = line.find("//"); comment != std::string::npos) line.resize(comment);
    std::istringstream words(line);
    std::string word;
    if (!(words >> word)) continue;
    if (word == "material" && depth == 0) {
      if (result) return result;
      std::string name;
      words >> name;
      if (const size_t brace = name.find('{'); brace != std::string::npos) name.resize(brace);
      if (name == wanted) {
        result.emplace();
        // OGRE's default, which leaves a texture unchanged
        result->material.diffuse = {1, 1, 1, 1};
      }
    } else if (result && word == "pass") {
      ++passes;
    } else if (result && passes <= 1) {
      std::vector<float> v;
      if (word == "texture") {
        if (result->texture.empty()) words >> result->texture;
      } else if (word == "ambient" || word == "diffuse" || word == "specular" ||
                 word == "emissive") {
        for (std::string number; words >> number;) {
          float value = 0;
          if (std::from_chars(number.data(), number.data() + number.size(), value).ec !=
              std::errc())
            break;
          v.push_back(value);
        }
        if (v.size() >= 3) {
          Material& m = result->material;
          Rgba& target = word == "ambient"    ? m.ambient
                         : word == "diffuse"  ? m.diffuse
                         : word == "specular" ? m.specular
                                              : m.emissive;
          target = {v[0], v[1], v[2], v.size() == 4 ? v[3] : 1.0f};
          // "specular r g b [a] shininess"
          if (word == "specular" && v.size() >= 4) m.shininess = v.back();
        }
      }
    }
    depth += static_cast<int>(std::count(line.begin(), line.end(), '{') -
                              std::count(line.begin(), line.end(), '}'));
  }
  return result;
}

// The material NAME in the .material files that the script's <uri>s lead to.
std::optional<Material> scripted_material(const Element& script, const std::string& name,
                                          ReadContext& context) {
  std::vector<std::string> files;
  const auto add_folder = [&](const fs::path& folder) {
    std::error_code error;
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      if (entry.path().extension() == ".material" && context.resources.may_read(entry.path()))
        found.push_back(entry.path().string());
    }
    std::sort(found.begin(), found.end());
    files.insert(files.end(), found.begin(), found.end());
  };
  std::vector<std::string> texture_folders;
  for (const Element* uri : script.all("uri")) {
    const auto path = context.resources.find(uri->text, script.source.file);
    if (!path) continue;
    std::error_code error;
    if (!fs::is_directory(*path, error))
      files.push_back(*path);
    else {
      add_folder(*path);
      texture_folders.push_back(*path);
    }
  }
  add_folder(fs::path(script.source.file).parent_path() / "materials/scripts");
  for (const auto& file : files) {
    std::optional<OgreMaterial> found;
    try {
      found = read_ogre_script(read_input(file, 4 << 20), name);
      context.documents.note(file);
    } catch (const InputError&) {
      continue;
    }
    if (!found) continue;
    if (!found->texture.empty()) {
      std::optional<std::string> texture = context.resources.find_texture(found->texture, file);
      for (const auto& folder : texture_folders) {
        if (texture) break;
        texture = context.resources.find_texture(fs::path(found->texture).filename().string(),
                                                 (fs::path(folder) / "script").string());
      }
      if (!texture) texture = context.resources.find_texture(found->texture, script.source.file);
      if (texture) {
        context.documents.note(*texture);
        found->material.texture = context.textures.take(*texture);
      }
    }
    return found->material;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Material> gazebo_material(const std::string& full_name) {
  std::string name = full_name;
  if (name.rfind("Gazebo/", 0) == 0) name = name.substr(7);
  bool glow = false, transparent = false;
  for (bool more = true; more;) {
    more = false;
    if (strip_suffix(name, "Transparent")) more = transparent = true;
    if (strip_suffix(name, "Overlay")) more = true;
    if (strip_suffix(name, "Glow")) more = glow = true;
  }
  for (const NamedColour& each : kGazeboColours) {
    if (name != each.name) continue;
    Material material;
    material.diffuse = {each.r, each.g, each.b, transparent ? 0.5f : 1.0f};
    material.ambient = material.diffuse;
    material.specular = {0.1f, 0.1f, 0.1f, 1};
    if (glow) material.emissive = {each.r, each.g, each.b, 1};
    return material;
  }
  return std::nullopt;
}

Rgba read_colour(const Element& element, const std::string& where, Findings& findings) {
  const std::vector<double> v = element.as_numbers(Allowed::any(quantity::kBrightness));
  if (v.size() != 3 && v.size() != 4) {
    element.fail("'" + element.text + "' has " + std::to_string(v.size()) +
                 " numbers; allowed are r g b and r g b a, from 0 to 1");
  }
  Rgba colour{0, 0, 0, 1};
  for (size_t i = 0; i < v.size(); ++i) colour[i] = static_cast<float>(std::clamp(v[i], 0.0, 1.0));
  if (std::any_of(v.begin(), v.end(), [](double each) { return each < 0.0 || each > 1.0; }))
    findings.repaired(element.source, where,
                      "<" + element.name + ">: '" + element.text +
                          "' is not allowed; allowed are numbers from 0 to 1; the nearest of these "
                          "are taken");
  return colour;
}

std::optional<Material> read_material(const Element& element, const std::string& where,
                                      ReadContext& context) {
  report_other_children(
      element,
      {"script", "ambient", "diffuse", "specular", "emissive", "pbr", "shininess", "double_sided"},
      {"shader", "lighting", "render_order"}, where, context.findings);
  Material material;
  bool said = false;
  if (const Element* script = element.child("script")) {
    const std::string name =
        script->string("name", script->text);  // old files: <script>NAME</script>
    if (const auto known = gazebo_material(name)) {
      material = *known;
      said = true;
    } else if (const auto found = scripted_material(*script, name, context)) {
      material = *found;
      said = true;
    } else if (!name.empty() && name != "__default__") {
      context.findings.unsupported(
          script->source, where,
          "the material script '" + name + "' is not known; the colour is grey instead");
    }
  }
  if (const Element* e = element.child("diffuse")) {
    material.diffuse = read_colour(*e, where, context.findings);
    if (!element.child("ambient") && !said) material.ambient = material.diffuse;
    said = true;
  }
  if (const Element* e = element.child("ambient")) {
    material.ambient = read_colour(*e, where, context.findings);
    if (!said) material.diffuse = material.ambient;
    said = true;
  }
  if (const Element* e = element.child("specular"))
    material.specular = read_colour(*e, where, context.findings), said = true;
  if (const Element* e = element.child("emissive"))
    material.emissive = read_colour(*e, where, context.findings), said = true;
  if (const Element* e = element.child("shininess"))
    material.shininess =
        static_cast<float>(e->as_number(Allowed::not_negative(quantity::kBrightness)));
  material.double_sided = element.boolean("double_sided", material.double_sided);
  for (const char* workflow : {"pbr/metal", "pbr/specular"}) {
    const Element* map = element.child(std::string(workflow) + "/albedo_map");
    if (!map || map->text.empty() || map->text == "__default__") continue;
    const auto path = context.resources.find_texture(map->text, map->source.file);
    if (path) {
      context.documents.note(*path);
      material.texture = context.textures.take(*path);
      said = true;
    } else {
      context.findings.unsupported(
          map->source, where,
          "the texture '" + map->text + "' is not found; the plain colour is shown instead");
    }
    break;
  }
  if (!said) return std::nullopt;
  return material;
}

}  // namespace ruedo::world
