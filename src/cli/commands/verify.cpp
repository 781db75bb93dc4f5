// ruedo verify: runs a log's run again, and says whether it gives the same bytes.
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/logs/logged_run.h"
#include "cli/support/commands.h"
#include "cli/support/extensions.h"
#include "cli/support/sandboxed.h"
#include "cli/support/signal_thread.h"
#include "engine/thread_limit.h"
#include "log/header.h"
#include "run/repeat/verify.h"
#include "system/to_stderr.h"

namespace ruedo::cli {
namespace {

struct VerifyArguments {
  bool sandboxed = false, partial = false;
  std::string log;
  int threads = 0;
};

std::string describe(const run::FirstDifference& difference) {
  const std::string where =
      fmt::format("{} at step {} ({:g} s{})", difference.channel, difference.step,
                  static_cast<double>(difference.time_us) * 1e-6,
                  difference.epoch > 0 ? fmt::format(", epoch {}", difference.epoch) : "");
  if (difference.field.empty())
    return fmt::format("{}: the log has {}, the repetition {}", where, difference.logged,
                       difference.repeated);
  return fmt::format("{}: {} is {} in the log, {} in the repetition", where, difference.field,
                     difference.logged, difference.repeated);
}

int repeat(const VerifyArguments& arguments, const log_header_t& header) {
  LoggedOptions logged = read_options(header, arguments.log);
  run::RunOptions options;
  options.remaps = std::move(logged.remaps);
  options.simulation.fleet.seed = static_cast<uint64_t>(header.seed);
  options.simulation.fleet.noise = !logged.world.no_noise;
  options.simulation.fleet.disabled = logged.world.disabled;
  for (const std::string& option : header.options) {
    if (!option.starts_with(log::kMesaOption)) options.result_options.push_back(option);
    if (option != "--mesa-environment") continue;
    for (std::string& here : mesa_options()) options.result_options.push_back(std::move(here));
  }
  const engine::ThreadLimit limit(arguments.threads);
  run::Verifier verifier(arguments.log, load(logged.world), std::move(options));
  const bool same_machine = verifier.machine_differences().empty();
  for (const std::string& line : verifier.machine_differences())
    fmt::print("not as in the log: {}\n", one_line(line));
  std::fflush(stdout);
  verifier.check_same_run();
  const run::Verification result = verifier.run();
  const std::string so_far = fmt::format(
      "{} messages, {} bytes, {:g} s of {}, seed {}", result.messages, result.bytes,
      static_cast<double>(result.time_us) * 1e-6, header.world, static_cast<uint64_t>(header.seed));
  if (result.difference) {
    fmt::print("{}: {}\nBefore it, {} were repeated byte for byte.\n", one_line(arguments.log),
               one_line(describe(*result.difference)), one_line(so_far));
    if (same_machine) return kCheckFailed;
    fmt::print(
        "The differences from the log's machine, above, may be the cause: only the same "
        "version and libraries give the same bytes. Repeat the log with Ruedo {0}: `pip install "
        "ruedo=={0}` in "
        "a virtual environment of its own, and `ruedo verify` there.\n",
        one_line(header.version.substr(0, header.version.find(' '))));
    return kEnvironment;
  }
  if (result.messages == 0) {
    fmt::print("{}: nothing was compared: the log has no messages to compare\n",
               one_line(arguments.log));
    return kCheckFailed;
  }
  if (!result.fault.empty() && !arguments.partial) {
    fmt::print(
        "{}: not verified to the end: {}; the rest repeats: {} (--partial is for logs that "
        "are known to be cut)\n",
        one_line(arguments.log), one_line(result.fault), one_line(so_far));
    return kCheckFailed;
  }
  fmt::print("{}: repeated byte for byte: {}\n", one_line(arguments.log), one_line(so_far));
  if (!result.fault.empty())
    fmt::print("{}: {}; verified up to there\n", one_line(arguments.log), one_line(result.fault));
  return kGood;
}

int verify(const VerifyArguments& arguments) {
  load_given_plugins();
  if (arguments.sandboxed) enter_sandbox(arguments.log, {});
  const SignalThread signals;
  const log_header_t header = run::read_header(arguments.log);
  log::check_files(header, arguments.log);
  return with_options_of(arguments.log, [&] { return repeat(arguments, header); });
}

void add_verify(CLI::App& app, Action& chosen) {
  CLI::App* command =
      app.add_subcommand("verify", "repeat a recorded run, and compare it byte by byte");
  const auto arguments = std::make_shared<VerifyArguments>();
  command->add_option("LOG", arguments->log, "recorded by ruedo run --record")->required();
  command
      ->add_option("--threads", arguments->threads,
                   "maximum number of threads in a module (default: one per core)")
      ->type_name("N")
      ->check(CLI::Range(1, 1024));
  command->add_flag("--partial", arguments->partial,
                    "accept a truncated log, and compare the messages that it has");
  add_plugin_argument(*command);
  add_sandbox_argument(*command, arguments->sandboxed);
  command->callback([arguments, &chosen] { chosen = [arguments] { return verify(*arguments); }; });
}

const RegisterCommand kRegister{51, add_verify};

}  // namespace
}  // namespace ruedo::cli
