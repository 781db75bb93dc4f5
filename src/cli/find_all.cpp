#include "cli/find_all.h"

#include <set>

#include "core/progress.h"
#include "core/utf8.h"
#include "engine/world.h"
#include "scene/render_texture.h"

namespace ruedo::cli {
namespace {

// Pictures that are there and cannot be decoded. Readers leave that to who draws: it takes long.
void check_textures(const model::WorldModel& world, std::vector<Finding>& findings) {
  std::set<std::string> seen;
  const auto look = [&](const model::Material& material, const std::string& owner) {
    const model::Texture* texture = material.texture.get();
    if (!texture || !seen.insert(texture->path.empty() ? owner : texture->path).second) return;
    if (scene::decode_texture(*texture).width > 0) return;
    findings.push_back(
        {Finding::Kind::unsupported,
         {texture->path.empty() ? owner : texture->path, 0},
         "",
         "the texture is no picture that can be read; the plain colour is shown instead"});
  };
  for (const model::ModelInstance& instance : world.models) {
    for (const model::Link& link : instance.model->links) {
      for (const model::Visual& visual : link.visuals) {
        if (visual.material) look(*visual.material, "");
        const model::Mesh* mesh = visual.geometry.mesh.get();
        if (!mesh || visual.material) continue;
        for (const model::Material& material : mesh->materials) look(material, mesh->name);
      }
    }
  }
}

}  // namespace

std::vector<Finding> find_all(const WorldArguments& arguments, bool& loaded) {
  loaded = false;
  std::vector<Finding> findings;
  try {
    const std::shared_ptr<const model::WorldModel> world = load(arguments);
    findings = world->findings;
    {
      const Progress progress("reading textures");
      check_textures(*world, findings);
    }
    // All that `ruedo run` makes before it starts; but it stops at the first device that it
    // refuses.
    engine::Channels channels;
    Findings of_run;
    engine::FleetOptions options;
    options.disabled = arguments.disabled;
    options.keep_going = true;
    const Progress progress("making " + world->name);
    const engine::World made(std::make_shared<engine::Plan>(*world), options, channels, of_run);
    loaded = !made.refused();
    findings.insert(findings.end(), of_run.list().begin(), of_run.list().end());
  } catch (const InputError& error) {
    if (error.source().file.empty()) throw;  // wrong usage
    findings.push_back({Finding::Kind::error, error.source(), "", in_one_line(error.message())});
  }
  return findings;
}

}  // namespace ruedo::cli
