#include "cli/support/find_all.h"

#include <algorithm>
#include <set>

#include "base/option_text.h"
#include "base/progress.h"
#include "base/utf8.h"
#include "engine/world.h"
#include "scene/pictures/render_texture.h"

namespace ruedo::cli {
namespace {

// Existing pictures that cannot be decoded. Readers leave decoding to the renderer: it takes long.
void check_textures(const world::WorldModel& world, std::vector<Finding>& findings) {
  std::set<std::string> seen;
  const auto look = [&](const world::Material& material, const std::string& owner) {
    const world::Texture* texture = material.texture.get();
    if (!texture || !seen.insert(texture->path.empty() ? owner : texture->path).second) return;
    if (scene::decode_texture(*texture).width > 0) return;
    findings.push_back(
        {Finding::Kind::unsupported,
         {texture->path.empty() ? owner : texture->path, 0},
         "",
         "the texture is not a picture that can be read; the plain colour is shown instead"});
  };
  for (const world::ModelInstance& instance : world.models) {
    for (const world::Link& link : instance.model->links) {
      for (const world::Visual& visual : link.visuals) {
        if (visual.material) look(*visual.material, "");
        const world::Mesh* mesh = visual.geometry.mesh.get();
        if (!mesh || visual.material) continue;
        for (const world::Material& material : mesh->materials) look(material, mesh->name);
      }
    }
  }
}

// All that `ruedo run` makes before it starts; but it stops at the first device that it refuses.
bool is_refused(const WorldArguments& arguments, const world::WorldModel& world,
                Findings& findings) {
  engine::Channels channels;
  engine::FleetOptions options;
  options.disabled = arguments.disabled;
  options.keep_going = true;
  const Progress progress("making " + world.name);
  return engine::World(std::make_shared<engine::Plan>(world), options, channels, findings)
      .refused();
}

bool is_wrong_option(const Finding& finding) {
  return finding.kind == Finding::Kind::error && is_option(finding.source);
}

}  // namespace

std::vector<Finding> find_all(const WorldArguments& arguments, ExitCode& refusal) {
  refusal = kBadInput;
  std::vector<Finding> findings;
  try {
    const std::shared_ptr<const world::WorldModel> world = load(arguments);
    findings = world->findings;
    {
      const Progress progress("reading textures");
      check_textures(*world, findings);
    }
    Findings of_run;
    if (!is_refused(arguments, *world, of_run)) refusal = kGood;
    findings.insert(findings.end(), of_run.list().begin(), of_run.list().end());
  } catch (const InputError& error) {
    if (error.source().file.empty()) throw;  // wrong usage
    findings.push_back({Finding::Kind::error, error.source(), "", in_one_line(error.message())});
  }
  if (refusal != kGood && std::any_of(findings.begin(), findings.end(), is_wrong_option))
    refusal = kWrongUsage;
  return findings;
}

void check_options(const WorldArguments& arguments, const world::WorldModel& world) {
  if (arguments.settings.empty() && arguments.disabled.empty() && arguments.faults.empty()) return;
  Findings findings;
  try {
    is_refused(arguments, world, findings);
  } catch (const InputError& error) {
    if (error.source().file.empty() || is_option(error.source())) throw;
  }
  const auto wrong = std::find_if(findings.list().begin(), findings.list().end(), is_wrong_option);
  if (wrong != findings.list().end()) throw InputError(wrong->source, wrong->text);
}

}  // namespace ruedo::cli
