// ruedo export: a log as an MCAP file, with Foxglove's message types.
#include <algorithm>
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/foxglove.h"
#include "cli/logged_run.h"
#include "cli/sandboxed.h"
#include "core/utf8.h"
#include "ruedo/errors.h"
#include "log/reader.h"
#include "run/log_worlds.h"

namespace ruedo::cli {
namespace {

struct ExportArguments {
  bool sandboxed = false;
  std::string log, out;
};

uint64_t nanoseconds(SimTime time_us) {
  constexpr SimTime kLatest_us = INT64_MAX / 1000;
  return static_cast<uint64_t>(std::clamp(time_us, SimTime{0}, kLatest_us)) * 1000;
}

int export_log(const ExportArguments& arguments) {
  if (arguments.sandboxed) enter_sandbox(arguments.log, {arguments.out});
  std::error_code error;
  if (std::filesystem::equivalent(arguments.log, arguments.out, error)) throw InputError({}, "OUT is the log itself: " + arguments.out);
  const log::Index index(arguments.log);
  const run::LogWorlds worlds(index, [&](const log_header_t& header) { return load_run(header, arguments.log); });
  log::Reader log(arguments.log);
  McapWriter out(arguments.out);
  FoxgloveExport foxglove(out);
  const run::LogWorlds::Scene* scene = nullptr;
  log::Event event;
  SimTime now_us = index.begin_us();
  uint64_t read = 0;
  while (log.next(event)) {
    now_us = std::max(now_us, event.timestamp_us);    // as in the index: times never go back
    if (const auto* next = &worlds.at(now_us); next != scene) {
      scene = next;
      foxglove.begin_scene(*scene, nanoseconds(now_us));
    }
    foxglove.add(event.channel, nanoseconds(now_us), event.data);
    ++read;
  }
  out.finish();
  for (const std::string& fault : {worlds.fault(), log.fault()}) {
    if (!fault.empty()) fmt::print(stderr, "ruedo: {}: {}\n", for_terminal(arguments.log), for_terminal(fault));
  }
  fmt::print("{}: {} messages of {}, as {} of Foxglove's and Ruedo's types", arguments.out, read, arguments.log, out.messages());
  if (foxglove.left_out() > 0) fmt::print("; {} of types that are not known, or damaged, are left out", foxglove.left_out());
  fmt::print("\n");
  return kGood;
}

void add_export(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("export", "write a log as an MCAP file with Foxglove's message types");
  const auto arguments = std::make_shared<ExportArguments>();
  command->add_option("LOG", arguments->log, "a standard LCM log")->required();
  command->add_option("OUT", arguments->out, "the file to write, such as run.mcap")->required();
  add_sandbox_argument(*command, arguments->sandboxed);
  command->callback([arguments, &chosen] { chosen = [arguments] { return export_log(*arguments); }; });
}

const RegisterCommand kRegister{53, add_export};

}  // namespace
}  // namespace ruedo::cli
