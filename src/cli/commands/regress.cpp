// ruedo regress: a user's regression test: a world, a client, and what is expected of the run.
// ctest and pytest run it.
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include <fmt/format.h>
#include <fnmatch.h>
#include <spdlog/spdlog.h>

#include "base/input_file.h"
#include "base/json.h"
#include "base/progress.h"
#include "base/utf8.h"
#include "bus/server_bus.h"
#include "cli/support/argument_rules.h"
#include "cli/support/client_process.h"
#include "cli/support/commands.h"
#include "cli/support/extensions.h"
#include "cli/support/range.h"
#include "cli/support/signal_thread.h"
#include "cli/support/view.h"
#include "engine/judge/judge.h"
#include "log/diff.h"
#include "log/reader.h"
#include "log/writer.h"
#include "ruedo/errors.h"
#include "run/run.h"
#include "system/isolation.h"
#include "system/output_file.h"
#include "system/to_stderr.h"

namespace ruedo::cli {
namespace {

namespace fs = std::filesystem;

// What is compared with the golden log, and the page of a run that failed: by the log's name.
constexpr const char *kKept = ".kept", *kPage = ".html";
constexpr double kPageSize_MB = 20.0;  // of the page that shows a failed run

struct RegressArguments {
  WorldArguments world;
  uint64_t seed = 1;
  std::string duration, rate = "max", client, golden, record, script, junit, html, json;
  double clearance_reach = 0.0;
  std::vector<std::string> remaps, wait_for, goals, tolerances, ignored, keep;
  judge::Expectations expected;
  double clearance = -1.0, odometry_error = -1.0;
  int lockstep = 0;
  bool renew = false, shared_network = false, no_page = false;
};

run::RunOptions server_options(const RegressArguments& arguments) {
  run::RunOptions options;
  options.rate = parse_rate(arguments.rate);
  options.duration_us = parse_duration_us(arguments.duration);
  options.lockstep = {arguments.lockstep, 30.0, run::LockstepOptions::Policy::fail};
  options.record = arguments.record;
  options.result_options = result_options(arguments.world);
  for (std::string& plugin : plugin_options()) options.result_options.push_back(std::move(plugin));
  options.remaps = parse_remaps(arguments.remaps);
  for (const std::string& text : arguments.remaps)
    options.result_options.push_back("--remap=" + text);
  for (const std::string& text : arguments.wait_for)
    options.wait_for.push_back(parse_wait_for(text));
  options.simulation.fleet.seed = arguments.seed;
  options.simulation.fleet.noise = !arguments.world.no_noise;
  options.simulation.fleet.disabled = arguments.world.disabled;
  return options;
}

// The run. What went wrong besides expectations, or "".
std::string run(const RegressArguments& arguments,
                const std::shared_ptr<const world::WorldModel>& world, bool isolated,
                judge::Judge& judge, SignalThread& signals) {
  const bus::ServerBus place =
      bus::open_server_bus(isolated ? "auto" : "auto-tcp", world->name,
                           [](const std::string& line) { spdlog::warn(line); });
  run::Run server(world, server_options(arguments), *place.bus);
  Progress progress("running " + world->name, parse_duration_us(arguments.duration));
  server.on_state([&](const Snapshot& snapshot) {
    judge.see(snapshot);
    progress.to(snapshot.time);
  });
  std::unique_ptr<ClientProcess> client;
  if (!arguments.client.empty()) {
    client = std::make_unique<ClientProcess>(
        arguments.client, std::vector<std::string>{"LCM_DEFAULT_URL=" + place.url.str()},
        [&server] { server.stop(); });
  }
  std::string fault;
  const SignalThread::Serving serving(signals, server);
  try {
    server.run();
  } catch (const run::LeaseEnded& ended) {
    fault = ended.what();
  }
  if (client && client->end() && !client->fault().empty())
    return "the client ended with " + client->fault();
  return fault;
}

bool fits_any(const std::string& channel, const std::vector<std::string>& patterns) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return fnmatch(pattern.c_str(), channel.c_str(), 0) == 0;
  });
}

bool holds_any(const std::string& path, const std::vector<std::string>& patterns) {
  log::Reader log(path);
  log::Event event;
  while (log.next(event)) {
    if (fits_any(event.channel, patterns)) return true;
  }
  return false;
}

// A log's events on the channels that are kept.
void keep_channels(const std::string& from, const std::string& to,
                   const std::vector<std::string>& patterns) {
  log::Reader log(from);
  log::Writer writer(to);
  log::Event event;
  while (log.next(event)) {
    if (fits_any(event.channel, patterns))
      writer.write(event.timestamp_us, event.channel, event.data.data(), event.data.size());
  }
  writer.flush();
  if (!writer.error().empty()) throw EnvironmentError(to + ": " + writer.error());
}

// What differs from the golden log, or "".
std::string compare(const RegressArguments& arguments, const std::string& kept,
                    const std::vector<log::DiffRule>& rules) {
  const log::Diff result = log::diff_logs(arguments.golden, kept, rules);
  for (const std::string& line : result.idle_rules) spdlog::warn(line);
  if (!arguments.junit.empty()) write_file(arguments.junit, log::diff_junit(result));
  if (!arguments.html.empty())
    write_file(arguments.html, log::diff_html(result, arguments.golden, kept));
  return result.same()
             ? ""
             : "the run differs from " + arguments.golden + ":\n" + log::diff_text(result);
}

// Holds the run against its golden log, or writes that one anew. What is wrong, or "".
std::string hold_to_golden(const RegressArguments& arguments,
                           const std::vector<log::DiffRule>& rules, bool renew) {
  const std::string &golden = arguments.golden, kept = arguments.record + kKept;
  if (std::error_code unreadable; !renew && !fs::exists(golden, unreadable))
    return "there is no golden log " + golden + " yet: run this once with RUEDO_RENEW=1";
  // A run that lacks what the golden log holds differs; --keep is wrong where neither has it.
  if (!holds_any(arguments.record, arguments.keep) &&
      (renew || !holds_any(golden, arguments.keep))) {
    throw InputError({}, fmt::format("--keep {}: no message of the run is on such a channel",
                                     fmt::join(arguments.keep, " ")));
  }
  keep_channels(arguments.record, kept, arguments.keep);
  if (!renew) return compare(arguments, kept, rules);
  if (const fs::path folder = fs::path(golden).parent_path(); !folder.empty()) {
    std::error_code error;  // writing the log reports what is wrong
    fs::create_directories(folder, error);
  }
  write_file(golden, read_input(kept, std::numeric_limits<size_t>::max()));
  fmt::print("renewed {}\n", golden);
  return "";
}

std::string run_script(const RegressArguments& arguments) {
  ClientProcess script(arguments.script,
                       {"RUEDO_LOG=" + fs::absolute(arguments.record).string(),
                        "RUEDO_WORLD=" + fs::absolute(arguments.world.world).string()},
                       [] {});
  script.wait();
  return script.fault().empty()
             ? ""
             : "the script ended with " + script.fault() + ": " + arguments.script;
}

// The failed run as a page beside its log, for machines without ruedo.
void attach_page(const std::string& log) {
#ifdef RUEDO_CONSOLE
  try {
    write_page(log, log + kPage, kPageSize_MB);
  } catch (const std::exception& error) {
    to_stderr("ruedo: no page of this run: {}\n", std::string(error.what()));
  }
#else
  static_cast<void>(log);
#endif
}

// The expectations that were not met, judged by the log's messages.
std::vector<judge::Failure> judged(judge::Judge& judge, const std::string& record) {
  log::Reader log(record);
  log::Event event;
  const auto wanted = [](const std::string& channel) {
    return channel.ends_with("/pose") || channel.ends_with("/odometry");
  };
  while (log.next(event, wanted)) judge.see(event.channel, event.data);
  return judge.failures();
}

// For programs that run many: {"faults": [...], "failures": [{"what", "time_s", "text"}],
// "metrics": {...}, "track": [[s, m, m]]}.
void write_verdict(const std::string& path, const std::vector<std::string>& faults,
                   judge::Judge& judge) {
  JsonWriter json;
  json.open('{').name("faults").open('[');
  for (const std::string& fault : faults) json.value(fault);
  json.close(']').name("failures").open('[');
  for (const judge::Failure& failure : judge.failures()) {
    json.open('{')
        .member("what", failure.what)
        .member("time_s", static_cast<double>(failure.time) * 1e-6)
        .member("text", failure.text)
        .close('}');
  }
  json.close(']').name("metrics").open('{');
  for (const judge::Metric& metric : judge.metrics()) json.member(metric.name, metric.value);
  json.close('}').name("track").open('[');
  for (const judge::Judge::Place& place : judge.track())
    json.open('[').value(place.time_s).value(place.x).value(place.y).close(']');
  json.close(']').close('}');
  write_file(path, json.text() + "\n");
}

// A run leaves two more files beside its log.
void check_files_beside(const RegressArguments& arguments) {
  const std::pair<const char*, const std::string&> given[] = {{"--golden", arguments.golden},
                                                              {"--junit", arguments.junit},
                                                              {"--html", arguments.html},
                                                              {"--json", arguments.json}};
  for (const char* end : {kKept, kPage}) {
    for (const auto& [option, file] : given) {
      if (!file.empty() && same_file(arguments.record + end, file))
        throw InputError({}, fmt::format("{} {}: this run writes a file of its own there, beside "
                                         "its log {}",
                                         option, file, arguments.record));
    }
  }
}

int regress(RegressArguments arguments) {
  const bool isolated = !arguments.shared_network && isolate();
  SignalThread signals;  // after isolate(), which wants to be alone
  judge::Expectations& expected = arguments.expected;
  for (const std::string& text : arguments.goals) expected.goals.push_back(judge::parse_goal(text));
  if (arguments.clearance >= 0.0) expected.clearance = arguments.clearance;
  if (arguments.odometry_error >= 0.0) expected.odometry_error = arguments.odometry_error;
  expected.clearance_reach = arguments.clearance_reach;
  if (arguments.keep.empty()) arguments.keep = {"*/pose"};
  const auto rules = log::DiffRule::all(arguments.tolerances, arguments.ignored);
  const char* environment = std::getenv("RUEDO_RENEW");
  const bool renew =
      arguments.renew || (environment && *environment && std::string(environment) != "0");
  const std::shared_ptr<const world::WorldModel> world = load(arguments.world);
  check_output(arguments.record);
  check_files_beside(arguments);
  print_findings(world->findings);
  judge::Judge judge(*world, expected);
  std::vector<std::string> failures;
  if (std::string fault = run(arguments, world, isolated, judge, signals); !fault.empty())
    failures.push_back(fault);
  if (const int signal = signals.told()) {
    to_stderr("ruedo: the run was ended by a signal; its log up to there is {}\n",
              arguments.record);
    return 128 + signal;
  }
  const size_t begin_of_judged = failures.size();
  for (const judge::Failure& failure : judged(judge, arguments.record))
    failures.push_back(judge::to_line(failure));
  const size_t end_of_judged = failures.size();
  if (!arguments.golden.empty()) {
    std::string fault;
    try {
      fault = hold_to_golden(arguments, rules, renew && failures.empty());
    } catch (const std::exception& error) {  // must not hide what has failed before
      if (failures.empty()) throw;
      fault = error.what();
    }
    if (!fault.empty()) failures.push_back(fault);
  }
  if (!arguments.script.empty()) {
    if (std::string fault = run_script(arguments); !fault.empty()) failures.push_back(fault);
  }
  for (const std::string& line : failures)
    to_stderr("FAILED: {}\n", for_terminal(line).c_str());  // a difference has lines of ours
  if (!arguments.json.empty()) {
    std::vector<std::string> faults = failures;
    faults.erase(faults.begin() + static_cast<std::ptrdiff_t>(begin_of_judged),
                 faults.begin() + static_cast<std::ptrdiff_t>(end_of_judged));
    write_verdict(arguments.json, faults, judge);
  }
  if (!failures.empty() && !arguments.no_page) attach_page(arguments.record);
  if (failures.empty()) fmt::print("passed; the run is in {}\n", arguments.record);
  return failures.empty() ? kGood : kCheckFailed;
}

void add_list(CLI::App& command, const char* name, std::vector<std::string>& to, const char* text,
              const char* type) {
  command.add_option(name, to, text)->type_name(type)->allow_extra_args(false);
}

void add_course(CLI::App& command, RegressArguments& a) {
  command
      .add_option("--client", a.client,
                  "command line of the client, for a shell; LCM_DEFAULT_URL says where the run is")
      ->type_name("COMMAND");
  command.add_option("--seed", a.seed, "of all noise")
      ->type_name("N")
      ->capture_default_str()
      ->check(is_seed);
  command
      .add_option("--duration", a.duration,
                  "end after this many seconds of sim time, or when the client ends")
      ->type_name("S")
      ->required();
  command.add_option("--rate", a.rate, "sim time per real time, or max")
      ->type_name("R|max")
      ->capture_default_str();
  command.add_option("--record", a.record, "the log of the run")->type_name("FILE")->required();
  command
      .add_option("--lockstep", a.lockstep,
                  "wait for this many clients, then advance as far as all of them allow")
      ->type_name("N")
      ->check(CLI::Range(1, 64));
  add_list(command, "--wait-for", a.wait_for,
           "do not pass a step at which a message on that channel is due: CHANNEL@HZ", "WAIT");
  add_list(command, "--remap", a.remaps, "give a channel another name: CHANNEL=NAME", "REMAP");
  command.add_flag("--shared-network", a.shared_network,
                   "no network of its own: for a client that needs other machines");
}

void add_expectations(CLI::App& command, RegressArguments& a) {
  command
      .add_option("--robot", a.expected.robot,
                  "whom the expectations are about (default: the first of the world)")
      ->type_name("NAME");
  add_list(command, "--goal", a.goals,
           "base_link gets within RADIUS of X, Y by a time: X,Y,RADIUS,BY (m, s)", "GOAL");
  command.add_flag("--no-contact", a.expected.no_contact,
                   "the robot touches nothing but the ground");
  command.add_option("--clearance", a.clearance, "at least so far from everything (m)")
      ->type_name("M")
      ->check(within(0.0, 100.0));
  command
      .add_option("--odometry-error", a.odometry_error,
                  "odometry at most so far from the truth (m)")
      ->type_name("M")
      ->check(within(0.0, 1e6));
  command
      .add_option("--clearance-reach", a.clearance_reach,
                  "measure the smallest clearance below this (m), for --json")
      ->type_name("M")
      ->check(within(0.0, 100.0));
  command
      .add_option("--script", a.script,
                  "command line that judges too, by its exit code; RUEDO_LOG is the run's log")
      ->type_name("COMMAND");
}

void add_golden(CLI::App& command, RegressArguments& a) {
  command.add_option("--golden", a.golden, "log to compare with")->type_name("FILE");
  add_list(command, "--keep", a.keep,
           "channels that golden logs hold; shell patterns (default: */pose)", "PATTERN");
  add_list(command, "--tolerance", a.tolerances, "as of ruedo diff", "RULE");
  add_list(command, "--ignore", a.ignored, "as of ruedo diff", "PATTERN");
  command.add_flag("--renew", a.renew,
                   "rewrite the golden log if everything else holds; or set RUEDO_RENEW=1");
}

void add_reports(CLI::App& command, RegressArguments& a) {
  command
      .add_option("--json", a.json,
                  "write what failed, and how well the run went in numbers, as JSON")
      ->type_name("FILE");
  command.add_option("--junit", a.junit, "write how the golden log compares as JUnit XML")
      ->type_name("FILE");
  command.add_option("--html", a.html, "write it as a page with plots")->type_name("FILE");
  command.add_flag("--no-page", a.no_page, "no page beside the log of a failed run");
  // Without it they would do nothing.
  for (const char* each : {"--keep", "--tolerance", "--ignore", "--renew", "--junit", "--html"})
    command.get_option(each)->needs(command.get_option("--golden"));
}

void add_regress(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("regress",
                                         "run a world with a client on a port of its own, and hold "
                                         "the run against what is expected of it");
  const auto arguments = std::make_shared<RegressArguments>();
  add_world_arguments(*command, arguments->world);
  add_course(*command, *arguments);
  add_expectations(*command, *arguments);
  add_golden(*command, *arguments);
  add_reports(*command, *arguments);
  command->callback([arguments, &chosen] { chosen = [arguments] { return regress(*arguments); }; });
}

const RegisterCommand kRegister{55, add_regress};

}  // namespace
}  // namespace ruedo::cli
