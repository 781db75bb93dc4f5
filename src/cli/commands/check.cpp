// ruedo check: everything that is wrong or not supported in a world file, with its place.
#include <fmt/format.h>

#include "base/json.h"
#include "base/utf8.h"
#include "cli/support/commands.h"
#include "cli/support/extensions.h"
#include "cli/support/find_all.h"
#include "cli/support/listing.h"
#include "cli/support/sandboxed.h"
#include "world/world_name.h"

namespace ruedo::cli {
namespace {

struct CheckArguments {
  bool sandboxed = false;
  WorldArguments world;
  bool json = false, strict = false;
};

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
  if (arguments.sandboxed) enter_sandbox(world::world_file(arguments.world.world), {});
  ExitCode refusal{};
  const std::vector<Finding> findings = find_all(arguments.world, refusal);
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
  if (refusal != kGood) return refusal;
  return errors > 0 || (arguments.strict && !findings.empty()) ? kCheckFailed : kGood;
}

void add_check(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand(
      "check", "report every fault and unsupported element of a world file, with file and line");
  const auto arguments = std::make_shared<CheckArguments>();
  add_world_arguments(*command, arguments->world);
  command->add_flag("--json", arguments->json, "print a JSON list");
  command->add_flag("--strict", arguments->strict,
                    "also fail on repaired and unsupported elements");
  add_sandbox_argument(*command, arguments->sandboxed);
  command->callback([arguments, &chosen] { chosen = [arguments] { return check(*arguments); }; });
}

const RegisterCommand kRegister{20, add_check};

}  // namespace
}  // namespace ruedo::cli
