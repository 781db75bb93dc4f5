// ruedo verify: runs a log's run again, and says whether it gives the same bytes.
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/commands.h"
#include "ruedo/errors.h"
#include "server/log_header.h"
#include "server/thread_limit.h"
#include "server/verify.h"

namespace ruedo::cli {
namespace {

struct VerifyArguments {
  std::string log;
  int threads = 0;
};

// What the options in a log's header say, as the command line of that run did.
void read_options(const log_header_t& header, const std::string& log, WorldArguments& world, server::ServerOptions& options) {
  for (const std::string& option : header.options) {
    const size_t equals = option.find('=');
    const std::string name = option.substr(0, equals), value = equals == std::string::npos ? "" : option.substr(equals + 1);
    if (name == "--spawn") world.spawns.push_back(value);
    else if (name == "--drive") world.drives.push_back(value);
    else if (name == "--allow-absolute") world.allow_absolute = true;
    else if (name == "--set") world.settings.push_back(value);
    else if (name == "--disable") world.disabled.push_back(value);
    else if (name == "--no-noise") world.no_noise = true;
    else if (name == "--remap") options.remaps.push_back(parse_remap(value));
    else throw InputError({log}, "its run had the option " + option + ", which this version does not know");
  }
  options.simulation.fleet.seed = static_cast<uint64_t>(header.seed);
  options.simulation.fleet.noise = !world.no_noise;
  options.simulation.fleet.disabled = world.disabled;
  options.result_options = header.options;
}

std::string describe(const server::FirstDifference& difference) {
  const std::string where = fmt::format("{} at step {} ({:g} s{})", difference.channel, difference.step,
                                        static_cast<double>(difference.time_us) * 1e-6,
                                        difference.epoch > 0 ? fmt::format(", epoch {}", difference.epoch) : "");
  if (difference.field.empty()) return fmt::format("{}: the log has {}, the repetition {}", where, difference.logged, difference.repeated);
  return fmt::format("{}: {} is {} in the log, {} in the repetition", where, difference.field, difference.logged, difference.repeated);
}

int verify(const VerifyArguments& arguments) {
  const log_header_t header = server::read_header(arguments.log);
  server::check_files(header, arguments.log);
  if (header.files.empty()) throw InputError({arguments.log}, "names no file that its world was made from");
  WorldArguments world;
  server::ServerOptions options;
  world.world = header.files.front().path;
  read_options(header, arguments.log, world, options);
  const server::ThreadLimit limit(arguments.threads);
  server::Verifier verifier(arguments.log, load(world), std::move(options));
  const bool same_machine = verifier.machine_differences().empty();
  for (const std::string& line : verifier.machine_differences()) fmt::print("not as in the log: {}\n", line);
  std::fflush(stdout);
  verifier.check_same_run();
  const server::Verification result = verifier.run();
  const std::string so_far = fmt::format("{} messages, {} bytes, {:g} s of {}, seed {}", result.messages, result.bytes,
                                         static_cast<double>(result.time_us) * 1e-6, header.world, static_cast<uint64_t>(header.seed));
  if (result.difference) {
    fmt::print("{}: {}\nBefore it, {} were repeated byte for byte.\n", arguments.log, describe(*result.difference), so_far);
    if (same_machine) return kCheckFailed;
    fmt::print("What is not as in the log may be why: bytes hold for one build on one kind of CPU. Repeat it there.\n");
    return kEnvironment;
  }
  fmt::print("{}: repeated byte for byte: {}\n", arguments.log, so_far);
  if (!result.fault.empty()) fmt::print("{}: {}; verified up to there\n", arguments.log, result.fault);
  return kGood;
}

void add_verify(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("verify", "repeat a recorded run, and compare it byte by byte");
  const auto arguments = std::make_shared<VerifyArguments>();
  command->add_option("LOG", arguments->log, "recorded by ruedo run --record")->required();
  command->add_option("--threads", arguments->threads, "most threads inside a module (default: one a core)")->type_name("N")->check(CLI::Range(1, 1024));
  command->callback([arguments, &chosen] { chosen = [arguments] { return verify(*arguments); }; });
}

const RegisterCommand kRegister{51, add_verify};

}  // namespace
}  // namespace ruedo::cli
