// ruedo run: loads a world and serves it until the end, Ctrl-C, or a client's QUIT.
#include <cerrno>
#include <atomic>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include "bus/lcm_bus.h"
#include "cli/commands.h"
#include "cli/listing.h"
#include "cli/view.h"
#include "ruedo/errors.h"
#include "server/server.h"
#include "server/thread_limit.h"

namespace ruedo::cli {
namespace {

struct RunArguments {
  WorldArguments world;
  uint64_t seed = 1;
  std::string rate = "1", duration, lcm, record, control = "on";
  std::vector<std::string> remaps;
  std::string view;
  bool viewed = false;
  bool paused = false, quiet = false, watch_stdin = false;
  int threads = 0;
};

// Takes SIGINT and SIGTERM in a thread of its own: a handler could do next to nothing. Make it before any other
// thread, which then inherits that the signals are blocked.
class SignalThread {
 public:
  SignalThread() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    thread_ = std::thread([this] { wait(); });
  }
  ~SignalThread() {
    done_ = true;
    pthread_kill(thread_.native_handle(), SIGTERM);
    thread_.join();
  }
  void serve(server::Server* server) { server_ = server; }

 private:
  void wait() {
    for (int signal = 0; sigwait(&signals_, &signal) == 0;) {
      if (done_) return;
      server::Server* server = server_;
      if (!server || asked_) std::_Exit(128 + signal);    // nothing to end cleanly, or it does not end
      asked_ = true;
      server->stop();
    }
  }

  sigset_t signals_;
  std::atomic<bool> done_{false};
  std::atomic<server::Server*> server_{nullptr};
  bool asked_ = false;
  std::thread thread_;
};

// Ends the run, as SIGTERM would, when standard input ends: the client that started this server holds the other end of
// the pipe, and the kernel closes it however that client ends. The thread waits in read() for as long as the process lives.
void watch_stdin() {
  std::thread([] {
    char bytes[256];
    ssize_t count = 0;
    do {
      count = read(STDIN_FILENO, bytes, sizeof bytes);
    } while (count > 0 || (count < 0 && errno == EINTR));
    kill(getpid(), SIGTERM);
  }).detach();
}

class StatusLine {
 public:
  StatusLine() : shown_(isatty(STDERR_FILENO) != 0) {}
  ~StatusLine() {
    if (drawn_) fmt::print(stderr, "\n");
  }

  void draw(const server::Status& status) {
    const auto now = std::chrono::steady_clock::now();
    const double real_s = std::chrono::duration<double>(now - last_time_).count();
    const double factor = static_cast<double>(status.time_us - last_.time_us) * 1e-6 / real_s;
    const double messages = static_cast<double>(status.messages - last_.messages) / real_s;
    last_ = status;
    last_time_ = now;
    if (!shown_) return;
    fmt::print(stderr, "\r\033[K{:.2f} s   {}   {:.0f} messages/s", static_cast<double>(status.time_us) * 1e-6,
               status.paused ? std::string("paused") : fmt::format("x {:.3g} real time", factor), messages);
    std::fflush(stderr);
    drawn_ = true;
  }

 private:
  bool shown_, drawn_ = false;
  server::Status last_;
  std::chrono::steady_clock::time_point last_time_ = std::chrono::steady_clock::now();
};

server::ServerOptions server_options(const RunArguments& arguments) {
  server::ServerOptions options;
  options.rate = parse_rate(arguments.rate);
  if (!arguments.duration.empty()) options.duration_us = parse_duration_us(arguments.duration);
  options.paused = arguments.paused;
  options.control = arguments.control == "on";
  options.record = arguments.record;
  options.result_options = result_options(arguments.world);
  for (const std::string& text : arguments.remaps) {
    options.remaps.push_back(parse_remap(text));
    options.result_options.push_back("--remap=" + text);
  }
  options.simulation.fleet.seed = arguments.seed;
  options.simulation.fleet.noise = !arguments.world.no_noise;
  options.simulation.fleet.disabled = arguments.world.disabled;
  return options;
}

int run(const RunArguments& arguments) {
  server::ServerOptions options = server_options(arguments);
  SignalThread signals;
  if (arguments.watch_stdin) watch_stdin();
  const server::ThreadLimit limit(arguments.threads);
  const std::shared_ptr<const model::WorldModel> world = load(arguments.world);
  bus::LcmBus bus(arguments.lcm);
  ViewedBus viewed(bus, arguments.viewed, arguments.view);
  server::Server server(world, std::move(options), viewed.bus());
  std::vector<Finding> findings = world->findings;
  findings.insert(findings.end(), server.findings().list().begin(), server.findings().list().end());
  print_findings(findings);
  if (!arguments.quiet) {
    const Style style = style_of(stdout);
    fmt::print("{}{}{}: steps of {:g} ms, seed {}, on {}\n", style.bold, world->name, style.off, static_cast<double>(world->step_us) * 1e-3,
               arguments.seed, bus.url().str());
    print_channels(stdout, server.info());
    std::fflush(stdout);
  }
  const std::shared_ptr<void> view = viewed.open(server, world->name);
  StatusLine status;
  server.on_status([&](const server::Status& now) { status.draw(now); });
  signals.serve(&server);
  server.run();
  signals.serve(nullptr);
  return kGood;
}

void add_run(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("run", "serve a world: step it, publish its sensors, take commands");
  const auto arguments = std::make_shared<RunArguments>();
  add_world_arguments(*command, arguments->world);
  command->add_option("--seed", arguments->seed, "of all noise")->type_name("N")->capture_default_str()->check([](const std::string& text) {
    uint64_t seed = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
    return error == std::errc() && end == text.data() + text.size() ? "" : "'" + text + "' is not allowed; a seed is a whole number from 0 to 18446744073709551615";
  });
  command->add_option("--rate", arguments->rate, "sim time per real time, or max")->type_name("R|max")->capture_default_str();
  command->add_option("--duration", arguments->duration, "end after so many seconds of sim time")->type_name("S");
  command->add_option("--lcm", arguments->lcm, "LCM address (default: $LCM_DEFAULT_URL, or LCM's group with ttl 0)")->type_name("URL");
  command->add_option("--record", arguments->record, "write a standard LCM log")->type_name("FILE");
  command->add_option("--remap", arguments->remaps, "give a channel another name: CHANNEL=NAME")->type_name("REMAP")->allow_extra_args(false);
  CLI::Option* view = command->add_option("--view", arguments->view, "serve the web console (default: 127.0.0.1:8080)");
  view->type_name("[ADDRESS:PORT]")->expected(0, 1);
  command->add_flag("--paused", arguments->paused, "start paused, at step 0");
  command->add_option("--threads", arguments->threads, "most threads inside a module (default: one a core)")->type_name("N")->check(CLI::Range(1, 1024));
  command->add_option("--control", arguments->control, "serve requests: on or off")->capture_default_str()->check(CLI::IsMember({"on", "off"}));
  command->add_flag("--watch-stdin", arguments->watch_stdin, "end when standard input does: for programs that start a server");
  command->add_flag("--quiet", arguments->quiet, "do not list the channels");
  command->callback([arguments, view, &chosen] {
    arguments->viewed = view->count() > 0;
    chosen = [arguments] { return run(*arguments); };
  });
}

const RegisterCommand kRegister{10, add_run};

}  // namespace
}  // namespace ruedo::cli
