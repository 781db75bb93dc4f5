// ruedo play: publishes a log's messages again, with the times between them; or shows them in the
// web console.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <memory>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include "bridges/ros2/bag/bag_log.h"
#include "bus/lcm_bus.h"
#include "bus/url_claim.h"
#include "cli/logs/played_run.h"
#include "cli/support/commands.h"
#include "cli/support/extensions.h"
#include "cli/support/range.h"
#include "cli/support/sandboxed.h"
#include "cli/support/signal_thread.h"
#include "cli/support/view.h"
#include "log/header.h"
#include "log/reader.h"
#include "ruedo/errors.h"
#include "system/to_stderr.h"

namespace ruedo::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kLongestSleep = std::chrono::milliseconds(100);  // Ctrl-C is seen after that
constexpr auto kShortSleep = std::chrono::milliseconds(5);      // a client's question is

volatile std::sig_atomic_t interrupted = 0;

// Without SA_RESTART, so that what waits, as for the reader of a FIFO, ends.
void heed(int signal) {
  struct sigaction action{};
  action.sa_handler = [](int) { interrupted = 1; };
  ::sigaction(signal, &action, nullptr);
}

struct PlayArguments {
  std::string log, speed = "1", lcm, view, html, other;
  double html_size = 20.0;
  bool viewed = false, sandboxed = false, waits = false;
};

// Channels that only a log has: they were never published.
bool in_logs_only(const std::string& channel) {
  return channel == log::kHeaderChannel || channel == log::kAppliedChannel ||
         channel == log::kStateHashChannel;
}

// When a message is due that comes so much later than the first one. At a low speed that may be
// more than a clock can hold: then it is a century.
Clock::time_point due(Clock::time_point begin, SimTime after_us, double speed) {
  constexpr double kCentury_s = 3.2e9;
  const double after_s =
      std::clamp(static_cast<double>(after_us) * 1e-6 / speed, -kCentury_s, kCentury_s);
  return begin +
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(after_s));
}

bool sleep_until(Clock::time_point time, PlayedRun& run, SimTime now_us) {
  while (!interrupted) {
    run.serve(now_us);
    const auto now = Clock::now();
    if (now >= time) return true;
    std::this_thread::sleep_until(std::min(time, now + kLongestSleep));
  }
  return false;
}

// Of what is shown, which may take long to read: until then a signal ends the program at once.
int show(const PlayArguments& arguments, double speed) {
  std::optional<SignalThread> signals(std::in_place);
  const ros2::BagLog first(arguments.log), second(arguments.other);  // as logs, where they are bags
  if (!arguments.html.empty())
    return write_page(first.path(), arguments.html, arguments.html_size), kGood;
  if (!std::isfinite(speed))
    throw InputError({}, "--speed max is not allowed with --view; allowed is a number");
  if (!arguments.lcm.empty())
    throw InputError(
        {}, "--lcm cannot be used with --view: the page shows the log, and nothing is published");
  const auto ready = [&] {  // the reader of the address may end it
    heed(SIGINT);
    heed(SIGTERM);
    signals.reset();
  };
  const auto serving = view_log(first.path(), arguments.view, speed, second.path(), ready);
  while (!interrupted) std::this_thread::sleep_for(kLongestSleep);
  return kGood;
}

int play(const PlayArguments& arguments) {
  load_given_plugins();
  read_given_types();
  if (arguments.sandboxed) enter_sandbox(arguments.log, {arguments.html}, arguments.other);
  const double speed = parse_rate(arguments.speed, "--speed");
  if (!arguments.html.empty() || arguments.viewed) return show(arguments, speed);
  heed(SIGINT);
  heed(SIGTERM);
  const ros2::BagLog played(arguments.log);  // as a log, where it is a bag
  log::Reader log(played.path());
  bus::LcmBus bus(arguments.lcm);
  PlayedRun run(played.path(), bus);
  if (const std::string server = bus::claimed_by(bus.url());
      !server.empty() && bus.url().scheme == "udpm")  // the others need one that carries it
    to_stderr(
        "ruedo: a server is at {}, too: {}. The log's messages mix with its own: take "
        "another port\n",
        bus.url().str(), server);
  log::Event event;
  int64_t messages = 0;
  uint64_t not_sent = 0;
  SimTime first_us = 0;
  Clock::time_point begin;
  if (arguments.waits && !run.serves())
    throw InputError({arguments.log},
                     "has no ruedo/header, so no client can join it: leave out --wait");
  while (arguments.waits && !interrupted && !run.asked()) std::this_thread::sleep_for(kShortSleep);
  while (!interrupted && log.next(event)) {
    if (in_logs_only(event.channel)) continue;
    if (messages == 0) first_us = event.timestamp_us, begin = Clock::now();
    run.serve(event.timestamp_us);
    if (std::isfinite(speed) &&
        !sleep_until(due(begin, event.timestamp_us - first_us, speed), run, event.timestamp_us))
      break;
    const uint64_t failed = bus.failed();
    bus.publish(event.channel, event.data.data(), event.data.size());
    not_sent += bus.failed() - failed;
    ++messages;
  }
  run.end();
  if (!log.fault().empty()) to_stderr("ruedo: {}: {}\n", arguments.log, log.fault());
  const double seconds =
      messages == 0 ? 0.0 : static_cast<double>(event.timestamp_us - first_us) * 1e-6;
  fmt::print("{}: {} messages, {:g} s, on {}{}{}\n", arguments.log, messages, seconds,
             bus.url().str(), interrupted ? "; interrupted" : "",
             not_sent == 0 ? "" : fmt::format("; {} not sent", not_sent));
  return kGood;
}

void add_play(CLI::App& app, Action& chosen) {
  CLI::App* command =
      app.add_subcommand("play", "publish a log's messages again, or show them in the web console");
  const auto arguments = std::make_shared<PlayArguments>();
  command->add_option("LOG", arguments->log, "a standard LCM log, or a ROS 2 bag of ruedo export")
      ->required();
  command->add_option("--speed", arguments->speed, "log time per real time, or max")
      ->type_name("S|max")
      ->capture_default_str();
  CLI::Option* view = command->add_option(
      "--view", arguments->view, "show it in the web console instead (default: 127.0.0.1:8080)");
  view->type_name("[ADDRESS:PORT]")->expected(0, 1);
  command->add_option("--html", arguments->html, "write it as a page that needs no server instead")
      ->type_name("FILE")
      ->excludes(view);
  CLI::Option* compare =
      command->add_option("--compare", arguments->other,
                          "show that log beside it in the web console: ghosts, differences");
  compare->type_name("LOG")->excludes("--html");
  command
      ->add_option("--html-size", arguments->html_size,
                   "largest size of the page; messages are thinned to fit")
      ->type_name("MB")
      ->capture_default_str()
      ->check(within(1.0, 1000.0))
      ->needs("--html");
  command
      ->add_option("--lcm", arguments->lcm,
                   "LCM address (default: $LCM_DEFAULT_URL, or LCM's group)")
      ->type_name("URL");
  command->add_flag("--wait", arguments->waits, "begin when the first client joins");
  add_plugin_argument(*command);
  add_types_argument(*command);
  add_sandbox_argument(*command, arguments->sandboxed);
  command->callback([arguments, view, compare, &chosen] {
    arguments->viewed = view->count() > 0 || compare->count() > 0;
    chosen = [arguments] { return play(*arguments); };
  });
}

const RegisterCommand kRegister{52, add_play};

}  // namespace
}  // namespace ruedo::cli
