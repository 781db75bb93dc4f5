// ruedo check: everything that is wrong or not supported in a world file, with its place.
#include <set>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/extensions.h"
#include "cli/listing.h"
#include "cli/sandboxed.h"
#include "core/json.h"
#include "core/progress.h"
#include "core/utf8.h"
#include "engine/world.h"
#include "model/world_name.h"
#include "ruedo/errors.h"
#include "scene/render_texture.h"

namespace ruedo::cli {
namespace {

struct CheckArguments {
  bool sandboxed = false;
  WorldArguments world;
  bool json = false, strict = false;
};

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

// What the readers, the devices and the physics found. loaded: `ruedo run` would start.
std::vector<Finding> find_all(const CheckArguments& arguments, bool& loaded) {
  loaded = false;
  std::vector<Finding> findings;
  try {
    const std::shared_ptr<const model::WorldModel> world = load(arguments.world);
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
    options.disabled = arguments.world.disabled;
    options.keep_going = true;
    const Progress progress("making " + world->name);
    const engine::World made(world, options, channels, of_run);
    loaded = !made.refused();
    findings.insert(findings.end(), of_run.list().begin(), of_run.list().end());
  } catch (const InputError& error) {
    if (error.source().file.empty()) throw;  // wrong usage
    findings.push_back({Finding::Kind::error, error.source(), "", error.message()});
  }
  return findings;
}

void print_json(const std::vector<Finding>& findings) {
  JsonWriter json;
  json.open('[');
  for (const Finding& finding : findings) {
    json.open('{')
        .member("kind", kind_name(finding.kind))
        .member("file", finding.source.file)
        .member("line", finding.source.line);
    json.member("element", finding.element).member("text", finding.text).close('}');
  }
  fmt::print("{}\n", json.close(']').text());
}

void print_text(const std::vector<Finding>& findings) {
  const Style style = style_of(stdout);
  for (const Finding::Kind kind :
       {Finding::Kind::error, Finding::Kind::unsupported, Finding::Kind::repaired}) {
    for (const FindingGroup& group : group(findings)) {
      if (group.kind != kind) continue;
      const char* colour = kind == Finding::Kind::error         ? style.red
                           : kind == Finding::Kind::unsupported ? style.yellow
                                                                : style.cyan;
      fmt::print("{}{}{}{}: {}\n", style.bold, colour, kind_name(kind), style.off,
                 for_terminal(group.text));
      for (const Finding* place : group.places) {
        fmt::print("    {}{}{}{}\n", for_terminal(place->source.str()), style.dim,
                   place->element.empty() ? "" : "  " + for_terminal(place->element), style.off);
      }
    }
  }
}

int check(const CheckArguments& arguments) {
  load_given_plugins();
  if (arguments.sandboxed) enter_sandbox(model::world_file(arguments.world.world), {});
  bool loaded = false;
  const std::vector<Finding> findings = find_all(arguments, loaded);
  int counts[3] = {0, 0, 0};
  for (const Finding& finding : findings) ++counts[static_cast<int>(finding.kind)];
  const int errors = counts[static_cast<int>(Finding::Kind::error)];
  if (arguments.json) {
    print_json(findings);
  } else {
    print_text(findings);
    const Style style = style_of(stdout);
    fmt::print("{}{}: {}{}\n", findings.empty() ? style.green : style.bold, arguments.world.world,
               findings.empty() ? "good"
                                : fmt::format("{}, {} not supported, {} repaired",
                                              counted(static_cast<size_t>(errors), "error"),
                                              counts[static_cast<int>(Finding::Kind::unsupported)],
                                              counts[static_cast<int>(Finding::Kind::repaired)]),
               style.off);
  }
  if (!loaded) return kBadInput;
  return errors > 0 || (arguments.strict && !findings.empty()) ? kCheckFailed : kGood;
}

void add_check(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand(
      "check", "name everything wrong or unsupported in a world file, with file and line");
  const auto arguments = std::make_shared<CheckArguments>();
  add_world_arguments(*command, arguments->world);
  command->add_flag("--json", arguments->json, "print a JSON list");
  command->add_flag("--strict", arguments->strict,
                    "what is repaired or not supported fails the check too");
  add_sandbox_argument(*command, arguments->sandboxed);
  command->callback([arguments, &chosen] { chosen = [arguments] { return check(*arguments); }; });
}

const RegisterCommand kRegister{20, add_check};

}  // namespace
}  // namespace ruedo::cli
