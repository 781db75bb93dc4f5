// Reads one model with the readers of world files. The source may be untrusted: see
// ResourceFinder::for_strangers.
#include "world/load_model.h"

#include <filesystem>

#include "world/sdf/sdf_reader.h"

namespace fs = std::filesystem;

namespace ruedo::world {
namespace {

// A missing file of the world's folder.
std::string path_of_text(const std::string& world_file) {
  return (fs::path(world_file).parent_path() / "the text").string();
}

LoadedModel read(const std::string& path, const std::string& world_file,
                 std::shared_ptr<const Element> document, LoadBudget* budget) {
  Findings findings;
  if (document) findings.refuse_what_is_not_finite();  // a client would not hear of a finding
  const ResourceFinder resources = ResourceFinder::for_strangers(world_file);
  DocumentStore documents;
  MeshImport import;
  import.budget = budget;
  TextureStore textures(findings);
  MeshLoader meshes(resources, textures, import);
  ReadContext context{findings, resources, documents, meshes, textures};
  SdfReader reader(context);
  if (document) documents.add(path, std::move(document));
  Element asker;
  asker.name = "SPAWN";
  const auto included = reader.read_file(path, asker);
  if (included.light || included.actor) {
    throw InputError(
        {path, (included.light ? included.light : included.actor)->source.line},
        included.light
            ? "holds a <light> and no <model>: lights stand in the world's file, or in a link"
            : "holds an <actor> and no <model>: actors stand in the world's file");
  }
  if (!included.model || !included.model->model)
    throw InputError({path, 0}, "holds no <model>, or one without a link");
  for (const std::string& file : meshes.files_read()) documents.note(file);
  LoadedModel loaded{included.model->model, dotted(included.name), findings.list(),
                     documents.files_read()};
  if (ModelInstance{loaded.name, {}, loaded.model}.is_robot())
    loaded.name = made_fit_for_channel(loaded.name);
  if (loaded.model->links.size() > kMostLinksOfSpawned) {
    throw InputError(loaded.model->source, "the model '" + loaded.name + "' has " +
                                               std::to_string(loaded.model->links.size()) +
                                               " links; allowed are " +
                                               std::to_string(kMostLinksOfSpawned));
  }
  return loaded;
}

}  // namespace

std::string model_file(const std::string& name, const std::string& world_file) {
  const ResourceFinder resources = ResourceFinder::for_strangers(world_file);
  const auto path = resources.find_model(name, world_file);
  if (!path)
    throw InputError(
        {},
        "'" + name + "' is not a model of Ruedo's and no file in the folders that are searched");
  return *path;
}

LoadedModel load_model(const std::string& name, const std::string& world_file, LoadBudget* budget) {
  return read(model_file(name, world_file), world_file, nullptr, budget);
}

LoadedModel load_model_text(const std::string& text, const std::string& world_file,
                            LoadBudget* budget) {
  const std::string path = path_of_text(world_file);
  try {
    std::shared_ptr<const Element> document = parse_document(text, path);
    LoadedModel loaded = read(path, world_file, std::move(document), budget);
    std::erase(loaded.files_read, path);
    for (Finding& each : loaded.findings) {
      if (each.source.file == path) each.source.file = "the text";
    }
    return loaded;
  } catch (const InputError& error) {
    if (error.source().file != path) throw;
    throw InputError({"the text", error.source().line}, error.message());
  }
}

}  // namespace ruedo::world
