// ruedo regress: a user's regression test: a world, a client, and what is expected of the run.
// ctest and pytest run it.
#include <algorithm>
#include <filesystem>
#include <optional>

#include <fmt/format.h>

#include "base/utf8.h"
#include "cli/support/argument_rules.h"
#include "cli/support/client_process.h"
#include "cli/support/commands.h"
#include "cli/support/extensions.h"
#include "cli/support/golden.h"
#include "cli/support/judged_run.h"
#include "cli/support/range.h"
#include "cli/support/ros2.h"
#include "cli/support/signal_thread.h"
#include "cli/support/view.h"
#include "engine/judge/judge.h"
#include "ruedo/errors.h"
#include "system/isolation.h"
#include "system/output_file.h"
#include "system/temporary_folder.h"
#include "system/to_stderr.h"

namespace ruedo::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPage = ".html";  // of a run that failed, after the log's name
constexpr double kPageSize_MB = 20.0;   // of the page that shows a failed run

struct RegressArguments {
  WorldArguments world;
  uint64_t seed = 1;
  std::string duration, rate, client, golden, record, script, junit, html, json;
  double clearance_reach = 0.0;
  std::vector<std::string> remaps, wait_for, goals, tolerances, ignored, keep;
  Ros2Arguments ros2;
  judge::Expectations expected;
  double clearance = -1.0, odometry_error = -1.0;
  double grace = 5.0, timeout = 600.0;  // s of real time
  int lockstep = 0;
  bool renew = false, shared_network = false, no_page = false, no_client_wait = false,
       allow_errors = false;
};

run::RunOptions server_options(const RegressArguments& arguments) {
  run::RunOptions options;
  // Nodes that nothing waits for need their time.
  const bool is_real_time = arguments.ros2.on && arguments.wait_for.empty();
  options.rate = parse_rate(!arguments.rate.empty() ? arguments.rate : is_real_time ? "1" : "max");
  options.duration_us = parse_duration_us(arguments.duration);
  options.lockstep = {arguments.lockstep, 30.0, run::LockstepOptions::Policy::fail};
  options.record = arguments.record;
  options.result_options = result_options(arguments.world);
  for (std::string& plugin : plugin_options()) options.result_options.push_back(std::move(plugin));
  for (auto& [name, other] : parse_remaps(arguments.remaps)) {
    if (name.starts_with('/')) continue;  // ROS's names, which do not affect the run
    options.result_options.push_back(fmt::format("--remap={}={}", name, other));
    options.remaps.emplace_back(std::move(name), std::move(other));
  }
  for (const std::string& text : arguments.wait_for)
    options.wait_for.push_back(parse_wait_for(text));
  options.simulation.fleet.seed = arguments.seed;
  options.simulation.fleet.noise = !arguments.world.no_noise;
  options.simulation.fleet.disabled = arguments.world.disabled;
  return options;
}

// "", or why it failed. The log that it looks at stays the one that is judged and kept.
std::string run_script(const RegressArguments& arguments) {
  const auto written = [&] {
    return std::pair(fs::file_size(arguments.record), fs::last_write_time(arguments.record));
  };
  const auto before = written();
  ClientProcess script(arguments.script,
                       {"RUEDO_LOG=" + fs::absolute(arguments.record).string(),
                        "RUEDO_WORLD=" + fs::absolute(arguments.world.world).string()},
                       [] {});
  script.wait();
  if (!script.fault().empty())
    return "the script ended with " + script.fault() + ": " + arguments.script;
  return written() == before ? "" : "the script changed the log of the run: " + arguments.script;
}

// The failed run as a page beside its log, for machines without ruedo. Returns its name; "": none.
std::string attach_page(const std::string& log) {
#ifdef RUEDO_CONSOLE
  try {
    write_page(log, log + kPage, kPageSize_MB);
    return log + kPage;
  } catch (const std::exception& error) {
    to_stderr("ruedo: no page of this run: {}\n", std::string(error.what()));
  }
#endif
  return "";
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

judge::Expectations expectations(const RegressArguments& arguments) {
  judge::Expectations expected = arguments.expected;
  for (const std::string& text : arguments.goals) expected.goals.push_back(judge::parse_goal(text));
  if (arguments.clearance >= 0.0) expected.clearance = arguments.clearance;
  if (arguments.odometry_error >= 0.0) expected.odometry_error = arguments.odometry_error;
  expected.clearance_reach = arguments.clearance_reach;
  return expected;
}

// The checks of a run that has ended, beside the judge's.
void add_files(const RegressArguments& arguments, const std::vector<log::DiffRule>& rules,
               bool renew, judge::Verdict& verdict) {
  const auto add = [&](const char* what, const std::string& fault, std::string evidence) {
    const bool failed = !fault.empty();
    verdict.checks.push_back({what,
                              failed ? judge::Outcome::failed : judge::Outcome::passed,
                              failed ? fault : std::move(evidence),
                              {}});
  };
  if (!arguments.script.empty()) add("script", run_script(arguments), "the script ended with 0");
  if (arguments.golden.empty()) return;
  std::string fault;
  const bool good = verdict.passed();
  try {
    fault = hold_to_golden({arguments.golden, arguments.keep, rules, arguments.html},
                           arguments.record, renew && good);
  } catch (const std::exception& error) {  // must not hide what has failed before
    if (good) throw;
    fault = error.what();
  }
  add("golden", fault, renew ? "golden log renewed" : "equal to " + arguments.golden);
}

void tell(const RegressArguments& arguments, const judge::Verdict& verdict) {
  for (const judge::Check& check : verdict.failures()) {
    const std::string text = judge::to_line(check);  // a difference has lines of ours
    to_stderr("FAILED: {}\n", for_terminal(text).c_str());
  }
  if (!arguments.json.empty()) write_file(arguments.json, judge::to_json(verdict));
  if (!arguments.junit.empty())
    write_file(arguments.junit, judge::to_junit(verdict, arguments.world.world));
  if (verdict.passed()) fmt::print("passed: {}\n", for_terminal(verdict.evidence()));
}

int regress(RegressArguments arguments) {
  const bool keeps_log = !arguments.record.empty();
  std::optional<TemporaryFolder> scratch;  // for readers of the log after the run
  if (!keeps_log && !(arguments.golden.empty() && arguments.script.empty())) {
    scratch.emplace("regress");
    arguments.record = *scratch / "run.lcm";
  }
  const bool isolated = !arguments.shared_network && isolate();
  SignalThread signals;  // after isolate(), which needs a single thread
  const auto rules = log::DiffRule::all(arguments.tolerances, arguments.ignored);
  const bool renew = is_told_to_renew() || arguments.renew;
  const std::shared_ptr<const world::WorldModel> world = load(arguments.world);
  if (!arguments.record.empty()) check_output(arguments.record);
  if (keeps_log) check_files_beside(arguments);
  judge::Judge judge(world, expectations(arguments));
  judge::Verdict verdict;
  const auto error = std::find_if(world->findings.begin(), world->findings.end(),
                                  [](const Finding& f) { return f.kind == Finding::Kind::error; });
  if (!arguments.allow_errors && error != world->findings.end()) {
    verdict.checks.push_back(world_check(*error));
    tell(arguments, verdict);
    print_findings(world->findings);
    return kCheckFailed;
  }
  run::RunOptions options = server_options(arguments);
  const Ros2Arguments ros2 = with_names(arguments.ros2, arguments.remaps, options.wait_for);
  std::vector<judge::Check> checks = run_judged(
      world,
      {std::move(options), ros2, isolated, arguments.client, !arguments.no_client_wait && !ros2.on,
       arguments.allow_errors, arguments.grace, arguments.timeout},
      judge, signals);
  if (const int signal = signals.told()) {
    to_stderr("ruedo: the run was ended by a signal{}\n",
              keeps_log ? "; its log up to there is " + arguments.record : "");
    return 128 + signal;
  }
  verdict = judge.verdict();
  if (arguments.client.empty()) verdict.checks.front().text += " without a client";
  verdict.checks.insert(verdict.checks.begin() + 1, checks.begin(), checks.end());
  add_files(arguments, rules, renew, verdict);
  std::string page;
  if (!verdict.passed() && keeps_log && !arguments.no_page) page = attach_page(arguments.record);
  tell(arguments, verdict);
  print_findings(world->findings);  // after the verdict, which a reader of CI's output looks for
  if (keeps_log)
    fmt::print("The run is in {}{}\n", arguments.record,
               page.empty() ? "" : ", and as a page in " + page);
  return verdict.passed() ? kGood : kCheckFailed;
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
  command
      .add_option("--rate", a.rate,
                  "sim time per real time, or max (default: max; 1 with --ros2 without --wait-for)")
      ->type_name("R|max");
  command.add_option("--record", a.record, "the log of the run (default: none)")->type_name("FILE");
  command
      .add_option("--lockstep", a.lockstep,
                  "wait for this many clients, then advance as far as all of them allow")
      ->type_name("N")
      ->check(CLI::Range(1, 64));
  command.add_flag("--no-client-wait", a.no_client_wait,
                   "do not wait until the client is heard on the bus: for one that only listens");
  command
      .add_option(
          "--grace", a.grace,
          "the client has so long to end after the run (s of real time); SIGTERM comes after "
          "half of it")
      ->type_name("S")
      ->capture_default_str()
      ->check(within(0.0, 3600.0));
  command
      .add_option("--timeout", a.timeout,
                  "fail a run that makes no progress for this long (s of real time)")
      ->type_name("S")
      ->capture_default_str()
      ->check(within(0.1, 1e6));
  add_list(command, "--wait-for", a.wait_for,
           "do not pass a step at which a message on that channel is due: CHANNEL@HZ", "WAIT");
  add_list(command, "--remap", a.remaps, "give a channel another name: CHANNEL=NAME", "REMAP");
  command.add_flag("--shared-network", a.shared_network,
                   "use the machine's network: for a client that needs other machines");
}

void add_expectations(CLI::App& command, RegressArguments& a) {
  command
      .add_option("--robot", a.expected.robot,
                  "robot that the expectations apply to (default: the first of the world)")
      ->type_name("NAME");
  add_list(command, "--goal", a.goals,
           "base_link gets within RADIUS of X, Y by a time: X,Y,RADIUS,BY (m, s)", "GOAL");
  command.add_flag("--no-contact", a.expected.no_contact,
                   "the robot touches nothing but the ground");
  command.add_option("--clearance", a.clearance, "smallest allowed distance to anything (m)")
      ->type_name("M")
      ->check(within(0.0, 100.0));
  command
      .add_option("--odometry-error", a.odometry_error, "largest allowed error of the odometry (m)")
      ->type_name("M")
      ->check(within(0.0, 1e6));
  command
      .add_option("--clearance-reach", a.clearance_reach,
                  "measure the smallest clearance below this (m), for --json")
      ->type_name("M")
      ->check(within(0.0, 100.0));
  command.add_flag("--allow-requests", a.expected.allow_requests,
                   "the client may move the robot by requests (SET_POSE, RESET, REMOVE, ...)");
  command.add_flag("--allow-errors", a.allow_errors, "run a world that has errors");
  command
      .add_option(
          "--script", a.script,
          "command line of a further check: it fails by its exit code; RUEDO_LOG is the log")
      ->type_name("COMMAND");
}

void add_golden(CLI::App& command, RegressArguments& a) {
  command.add_option("--golden", a.golden, "log to compare with")->type_name("FILE");
  add_list(command, "--keep", a.keep,
           "channels that golden logs hold; shell patterns (default: */pose)", "PATTERN");
  add_list(command, "--tolerance", a.tolerances, "tolerance, as in ruedo diff", "RULE");
  add_list(command, "--ignore", a.ignored, "fields to ignore, as in ruedo diff", "PATTERN");
  command.add_flag("--renew", a.renew,
                   "rewrite the golden log if everything else holds; or set RUEDO_RENEW=1");
}

void add_reports(CLI::App& command, RegressArguments& a) {
  command
      .add_option("--json", a.json,
                  "write what failed, and how well the run went in numbers, as JSON")
      ->type_name("FILE");
  command
      .add_option("--junit", a.junit, "write the verdict as JUnit XML, a test case for each check")
      ->type_name("FILE");
  command.add_option("--html", a.html, "write it as a page with plots")->type_name("FILE");
  command.add_flag("--no-page", a.no_page, "write no page beside the log of a failed run");
  // Without it they would do nothing.
  for (const char* each : {"--keep", "--tolerance", "--ignore", "--renew", "--html"})
    command.get_option(each)->needs(command.get_option("--golden"));
}

void add_regress(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("regress",
                                         "run a world with a client in a network of its own, and "
                                         "check the run against expectations");
  const auto arguments = std::make_shared<RegressArguments>();
  add_world_arguments(*command, arguments->world);
  add_course(*command, *arguments);
  const CLI::Option* ros2 = add_ros2_options(*command, arguments->ros2);
  add_expectations(*command, *arguments);
  add_golden(*command, *arguments);
  add_reports(*command, *arguments);
  command->callback([arguments, ros2, &chosen] {
    arguments->ros2.on = ros2->count() > 0;
    chosen = [arguments] {
      if (arguments->keep.empty()) arguments->keep = {"*/pose"};
      return regress(*arguments);
    };
  });
}

const RegisterCommand kRegister{55, add_regress};

}  // namespace
}  // namespace ruedo::cli
