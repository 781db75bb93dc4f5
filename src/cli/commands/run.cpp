// ruedo run: loads a world and serves it until the end, Ctrl-C, or a client's QUIT.
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <list>
#include <optional>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "base/utf8.h"
#include "bridges/foxglove/foxglove_server.h"
#include "bus/server_bus.h"
#include "cli/support/argument_rules.h"
#include "cli/support/commands.h"
#include "cli/support/extensions.h"
#include "cli/support/find_all.h"
#include "cli/support/launcher_pipe.h"
#include "cli/support/listing.h"
#include "cli/support/progress_line.h"
#include "cli/support/range.h"
#include "cli/support/run_command.h"
#include "cli/support/sandboxed.h"
#include "cli/support/signal_thread.h"
#include "cli/support/view.h"
#include "engine/thread_limit.h"
#include "log/ring.h"
#include "ruedo/errors.h"
#include "run/run.h"
#include "system/leftovers.h"
#include "system/output_file.h"
#include "system/to_stderr.h"
#include "world/world_name.h"

namespace ruedo::cli {
namespace {

using foxglove::FoxgloveServer;

// Files made for this run alone: their maker may have been killed by then.
class Temporary {
 public:
  explicit Temporary(const std::string& path) : path_(path), leftover_(path) {}
  ~Temporary() {
    std::error_code gone_already;
    std::filesystem::remove_all(path_, gone_already);
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

 private:
  const std::string path_;
  const Leftover leftover_;
};

// False when it has no reader: a closed pipe, a terminal that is gone.
bool is_printed(const std::function<void()>& print) {
  try {
    print();
    return std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  } catch (const std::system_error&) {
    return false;
  }
}

class StatusLine {
 public:
  explicit StatusLine(bool quiet) : shown_(!quiet && isatty(STDERR_FILENO) != 0) {}
  ~StatusLine() {
    if (drawn_) to_stderr("\n");
  }

  void draw(const run::Status& status) {
    const auto now = std::chrono::steady_clock::now();
    const double real_s = std::chrono::duration<double>(now - last_time_).count();
    const double factor = static_cast<double>(status.time_us - last_.time_us) * 1e-6 / real_s;
    const double messages = static_cast<double>(status.messages - last_.messages) / real_s;
    last_ = status;
    last_time_ = now;
    if (!shown_) return;
    std::string line = status.repeating ? progress_text() : "";
    if (line.empty()) {
      line = fmt::format(
          "{:.2f} s   {}   {:.0f} messages/s", static_cast<double>(status.time_us) * 1e-6,
          status.paused ? std::string("paused") : fmt::format("x {:.3g} real time", factor),
          messages);
    }
    shown_ = drawn_ = to_stderr("\r\033[K{}", line);
  }

 private:
  bool shown_, drawn_ = false;
  run::Status last_;
  std::chrono::steady_clock::time_point last_time_ = std::chrono::steady_clock::now();
};

run::LockstepOptions lockstep_options(const RunArguments& arguments) {
  using Policy = run::LockstepOptions::Policy;
  if (arguments.lockstep > 0 && arguments.control == "off")
    throw InputError({}, "--lockstep needs requests: not with --control off");
  const Policy policy = arguments.lease_policy == "drop"   ? Policy::drop
                        : arguments.lease_policy == "fail" ? Policy::fail
                                                           : Policy::pause;
  return {arguments.lockstep, arguments.lease, policy};
}

run::RunOptions server_options(const RunArguments& arguments) {
  run::RunOptions options;
  options.rate = parse_rate(arguments.lockstep > 0   ? "max"
                            : arguments.rate.empty() ? "1"
                                                     : arguments.rate);
  if (!arguments.duration.empty()) options.duration_us = parse_duration_us(arguments.duration);
  options.paused = arguments.paused;
  options.lockstep = lockstep_options(arguments);
  options.control = arguments.control == "on";
  options.record = arguments.record;
  options.record_limit = static_cast<int64_t>(arguments.record_limit);
  options.result_options = result_options(arguments.world);
  for (auto& [name, other] : parse_remaps(arguments.remaps)) {
    if (name.starts_with('/')) continue;  // ROS's names, which do not affect the run
    options.result_options.push_back(fmt::format("--remap={}={}", name, other));
    options.remaps.emplace_back(std::move(name), std::move(other));
  }
  for (const std::string& text : arguments.wait_for)
    options.wait_for.push_back(parse_wait_for(text));
  if (arguments.lockstep > 0 && !arguments.wait_for.empty())
    throw InputError({}, "--lockstep cannot be used with --wait-for");
  options.edited = arguments.viewed;
  options.save = arguments.save;
  options.snapshots = arguments.snapshots;
  options.repeat = arguments.restore;
  options.simulation.fleet.seed = arguments.seed;
  options.simulation.fleet.noise = !arguments.world.no_noise;
  options.simulation.fleet.disabled = arguments.world.disabled;
  return options;
}

// The settings that clients need to find this server, if they would not by default.
void announce(const bus::ServerBus& place) {
  if (!place.note.empty()) spdlog::warn(place.note);
  if (place.announce) fmt::print("{}\n", bus::export_line(place.url));
  std::fflush(stdout);
}

void print_world(const run::Run& server, const world::WorldModel& world, const bus::LcmUrl& url) {
  const Style style = style_of(stdout);
  const char* hint = url.scheme == "memq" ? ", which no other program hears" : "";
  fmt::print("{}{}{}: steps of {:g} ms, seed {}, on {}{}\n", style.bold, for_terminal(world.name),
             style.off, static_cast<double>(world.step_us) * 1e-3,
             static_cast<uint64_t>(server.info().front().seed), url.str(), hint);
  print_channels(stdout, server.info());
  std::fflush(stdout);
}

// The file that unix:// makes.
std::string socket_of(const std::string& lcm) {
  const bus::LcmUrl url = lcm == "auto" ? bus::LcmUrl{} : bus::parse_url(lcm);
  return url.scheme == "unix" ? url.host : "";
}

// --strict: the exit code where the world is not as its files say, with what `ruedo check` finds.
int strict_check(const WorldArguments& world) {
  ExitCode refusal{};
  const std::vector<Finding> findings = find_all(world, refusal);
  if (findings.empty()) return kGood;
  print_findings(findings);
  to_stderr("ruedo: {} is not run: --strict refuses a world with findings\n", world.world);
  return refusal == kGood ? kCheckFailed : refusal;
}

// And refuses what can be refused by then.
std::shared_ptr<const world::WorldModel> load_to_serve(const RunArguments& arguments) {
  std::shared_ptr<const world::WorldModel> world = load(arguments.world);
  check_output(arguments.record);
  if (arguments.foxglove) FoxgloveServer::check(arguments.foxglove_address);
  return world;
}

// As after SIGTERM: the log is closed properly.
void stop_soon(run::Run& server, bool no_state_comes_by_itself) {
  server.on_state([&server](const Snapshot&) { server.stop(); });
  if (no_state_comes_by_itself) server.stop();
}

}  // namespace

int run_world(const RunArguments& arguments) {
  const std::list<Temporary> temporary(arguments.temporary.begin(), arguments.temporary.end());
  run::RunOptions options = server_options(arguments);
  load_given_plugins();
  read_given_types();
  if (arguments.sandboxed)
    enter_sandbox(world::world_file(arguments.world.world),
                  {arguments.record, arguments.snapshots, socket_of(arguments.lcm)});
  SignalThread signals;
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe is reported by write()
  std::optional<LauncherPipe> launcher;
  if (arguments.watch_stdin || arguments.follow_stdin) launcher.emplace(arguments.follow_stdin);
  const engine::ThreadLimit limit(arguments.threads);
  if (arguments.strict) {
    if (const int code = strict_check(arguments.world); code != kGood) return code;
  }
  const std::shared_ptr<const world::WorldModel> world = load_to_serve(arguments);
  for (std::string& plugin : plugin_options()) options.result_options.push_back(std::move(plugin));
  const bus::ServerBus place = bus::open_server_bus(
      arguments.lcm, world->name, [](const std::string& line) { spdlog::warn(line); });
  RunView viewed(arguments.viewed, arguments.view);
  viewed.follow(options);
  const Ros2Arguments ros2 = with_names(arguments.ros2, arguments.remaps, options.wait_for);
  options.wait_for = with_channels(std::move(options.wait_for), *world, ros2);
  std::unique_ptr<Ros2Network> network = Ros2Network::open(ros2);
  run::Run server(world, std::move(options), *place.bus);
  const std::unique_ptr<Ros2Node> node = Ros2Node::open(server, ros2, std::move(network));
  const std::unique_ptr<FoxgloveServer> foxglove =
      arguments.foxglove ? FoxgloveServer::open(server, arguments.foxglove_address) : nullptr;
  place.claim->describe(
      fmt::format("pid {}, world {}, run {}", getpid(), world->name, server.run_id()));
  // From the first line on that says so: a program that reads it may end the run, and has its log.
  const SignalThread::Serving serving(signals, server);
  std::shared_ptr<void> view;
  const bool is_read = is_printed([&] {
    announce(place);
    std::vector<Finding> findings = world->findings;
    findings.insert(findings.end(), server.findings().list().begin(),
                    server.findings().list().end());
    print_findings(findings);
    if (!arguments.quiet) print_world(server, *world, place.url);
    view = viewed.open(server, world->name, arguments.save);
    if (node && !arguments.quiet) node->print();
    if (foxglove) foxglove->print();
  });
  if (!is_read) stop_soon(server, arguments.lockstep > 0);
  end_progress_line();
  StatusLine status(arguments.quiet);
  server.on_status([&](const run::Status& now) { status.draw(now); });
  const LauncherPipe::Pacing pacing(launcher, server);
  if (node) node->wait_for_peers();
  try {
    server.run();
  } catch (const run::LeaseEnded& ended) {
    to_stderr("ruedo: {}\n", std::string(ended.what()));
    return kCheckFailed;
  }
  return kGood;
}

namespace {

// "2GB" becomes a number of bytes; what is wrong with it, or "".
std::string to_bytes(std::string& text) {
  std::string refusal = "'" + text + "' is not allowed; 16MB and more is, such as 2GB";
  const bool negative = text[0] == '-';
  try {
    if (!CLI::AsSizeValue(false)(text).empty() || text.size() > 18 || negative) return refusal;
    return std::stoll(text) >= log::Ring::kLeastLimit ? "" : refusal;
  } catch (const CLI::Error&) {
    return refusal;
  }
}

void add_pace(CLI::App& command, RunArguments& arguments) {
  command.add_option("--seed", arguments.seed, "of all noise")
      ->type_name("N")
      ->capture_default_str()
      ->check(is_seed);
  command
      .add_option(
          "--rate", arguments.rate,
          "sim time per real time, or max (default: 1); in lockstep the grants alone pace it")
      ->type_name("R|max");
  command.add_option("--duration", arguments.duration, "end after this many seconds of sim time")
      ->type_name("S");
  command.add_flag("--paused", arguments.paused, "start paused, at step 0");
  command
      .add_option("--wait-for", arguments.wait_for,
                  "wait at each step where a command is due: CHANNEL@HZ")
      ->type_name("INPUT")
      ->allow_extra_args(false);
  command
      .add_option("--threads", arguments.threads,
                  "maximum number of threads in a module (default: one per core)")
      ->type_name("N")
      ->check(CLI::Range(1, 1024));
}

void add_lockstep(CLI::App& command, RunArguments& arguments) {
  CLI::Option* lockstep =
      command
          .add_option("--lockstep", arguments.lockstep,
                      "wait for this many clients, then advance as far as all of them allow")
          ->type_name("N")
          ->check(CLI::Range(1, 64));
  command
      .add_option("--lease", arguments.lease,
                  "seconds of real time after which a silent client of lockstep loses its lease")
      ->type_name("S")
      ->capture_default_str()
      ->check(within(0.01, 1e6))
      ->needs(lockstep);
  command
      .add_option("--lease-policy", arguments.lease_policy,
                  "then: pause the run, drop the client, or fail the run with exit code 1")
      ->capture_default_str()
      ->check(CLI::IsMember({"pause", "drop", "fail"}))
      ->needs(lockstep);
}

void add_bus(CLI::App& command, RunArguments& arguments) {
  command
      .add_option("--lcm", arguments.lcm,
                  "LCM address, or auto for a free port (default: $LCM_DEFAULT_URL, or LCM's "
                  "group with ttl 0)")
      ->type_name("URL|auto");
  command.add_option("--remap", arguments.remaps, "give a channel another name: CHANNEL=NAME")
      ->type_name("REMAP")
      ->allow_extra_args(false);
  add_types_argument(command);
  command.add_option("--control", arguments.control, "serve requests: on or off")
      ->capture_default_str()
      ->check(CLI::IsMember({"on", "off"}));
}

void add_files(CLI::App& command, RunArguments& arguments) {
  CLI::Option* record =
      command.add_option("--record", arguments.record, "write a standard LCM log")
          ->type_name("FILE");
  command
      .add_option(
          "--record-limit", arguments.record_limit,
          "limit the size of the recording (16MB or more, for example 2GB): FILE keeps what "
          "repeats the run, numbered files beside it the latest messages")
      ->type_name("SIZE")
      ->transform(CLI::Validator(to_bytes, "", ""))
      ->needs(record);
  command
      .add_option("--snapshots", arguments.snapshots,
                  "the folder where clients may save the state, and restore it")
      ->type_name("FOLDER");
  command
      .add_option("--restore", arguments.restore,
                  "begin with the state of a snapshot of the same world and options")
      ->type_name("FILE");
}

// An option without a value is on when it is given.
struct Viewers {
  CLI::Option *console, *foxglove, *ros2;
};

Viewers add_viewers(CLI::App& command, RunArguments& arguments) {
  const auto optional = [&](const char* name, std::string& value, const char* text,
                            const char* type) {
    return command.add_option(name, value, text)->type_name(type)->expected(0, 1);
  };
  const Viewers viewers{
      optional("--view", arguments.view, "serve the web console (default: 127.0.0.1:8080)",
               "[ADDRESS:PORT]"),
      optional("--foxglove", arguments.foxglove_address,
               "show the run in Foxglove, by its WebSocket protocol (default: 127.0.0.1:8765)",
               "[ADDRESS:PORT]"),
      add_ros2_options(command, arguments.ros2)};
  return viewers;
}

void add_run(CLI::App& app, Action& chosen) {
  CLI::App* command =
      app.add_subcommand("run", "serve a world: step it, publish its sensors, take commands");
  const auto arguments = std::make_shared<RunArguments>();
  add_world_arguments(*command, arguments->world);
  add_pace(*command, *arguments);
  add_lockstep(*command, *arguments);
  add_bus(*command, *arguments);
  add_files(*command, *arguments);
  const Viewers viewers = add_viewers(*command, *arguments);
  command->add_flag("--strict", arguments->strict,
                    "refuse to run if `ruedo check --strict` finds anything");
  command->add_flag("--watch-stdin", arguments->watch_stdin,
                    "end when standard input is closed: for programs that start a server");
  command->add_flag("--follow-stdin", arguments->follow_stdin,
                    "the same, and wait for that program, which writes how far it has come");
  command
      ->add_option("--temporary", arguments->temporary,
                   "remove this file or folder, ruedo-*, at the end: for programs that start a "
                   "server")
      ->type_name("PATH")
      ->check([](const std::string& path) {
        const bool is_ours = std::filesystem::path(path).filename().string().starts_with("ruedo-");
        return is_ours ? "" : "its name begins with ruedo-";
      })
      ->allow_extra_args(false);
  command->add_flag("--quiet", arguments->quiet,
                    "neither list the channels nor show progress on a terminal");
  add_sandbox_argument(*command, arguments->sandboxed);
  command->callback([arguments, viewers, &chosen] {
    arguments->viewed = viewers.console->count() > 0;
    arguments->foxglove = viewers.foxglove->count() > 0;
    arguments->ros2.on = viewers.ros2->count() > 0;
    chosen = [arguments] { return run_world(*arguments); };
  });
}

const RegisterCommand kRegister{10, add_run};

}  // namespace
}  // namespace ruedo::cli
