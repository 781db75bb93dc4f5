// ruedo bench: how much faster than real time this machine runs 1, 10, 100, ... robots, each with an LRF, sixteen sonars
// and odometry, in rooms with contacts; docs/performance.md says what the figures mean.
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "bus/lcm_bus.h"
#include "cli/bench_world.h"
#include "cli/commands.h"
#include "ruedo/errors.h"
#include "ruedo/move_command_t.hpp"
#include "server/server.h"
#include "server/thread_limit.h"

extern char** environ;

namespace ruedo::cli {
namespace {

constexpr std::array kDefaultRobots{1, 10, 100, 1000};

struct BenchArguments {
  std::vector<int> robots;
  double duration_s = 0.0;    // sim time; 0: by the number of robots
  int threads = 0;
  bool json = false, one = false;
  std::string lcm, write_world;
};

// Takes every message, encoded as it would go out, and counts it.
class CountingSink : public Bus {
 public:
  void publish(const std::string&, const uint8_t*, size_t size) override {
    ++messages;
    bytes += size;
  }
  void listen(const std::vector<std::string>&, Handler, const std::vector<std::string>&) override {}

  uint64_t messages = 0, bytes = 0;
};

// Passes on what it counts.
class CountingBus : public CountingSink {
 public:
  explicit CountingBus(Bus& bus) : bus_(bus) {}
  void publish(const std::string& channel, const uint8_t* data, size_t size) override {
    CountingSink::publish(channel, data, size);
    bus_.publish(channel, data, size);
  }

 private:
  Bus& bus_;
};

struct Row {
  int robots = 0;
  double load_s = 0.0, sim_s = 0.0, wall_s = 0.0, cpu_s = 0.0, memory_mb = 0.0;
  uint64_t messages = 0, bytes = 0;

  double real_time_factor() const { return sim_s / wall_s; }
};

std::string to_json(const Row& row) {
  return fmt::format(
      "{{\"simulator\": \"Ruedo\", \"robots\": {}, \"real_time_factor\": {:.6g}, \"sim_s\": {:.6g}, \"wall_s\": {:.6g}, \"cpu_s\": {:.6g}, "
      "\"load_s\": {:.6g}, \"memory_mb\": {:.6g}, \"step_ms\": 5, \"messages_per_sim_s\": {:.6g}, \"bytes_per_sim_s\": {:.6g}}}",
      row.robots, row.real_time_factor(), row.sim_s, row.wall_s, row.cpu_s, row.load_s, row.memory_mb,
      static_cast<double>(row.messages) / row.sim_s, static_cast<double>(row.bytes) / row.sim_s);
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) { return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// Around its circle for ever: a primitive needs no repeating.
std::vector<uint8_t> circle_command() {
  move_command_t command{};
  command.kind = move_command_t::ARC;
  command.value = 1e6;
  command.radius = 1.0;
  command.speed = 0.4;
  std::vector<uint8_t> bytes(static_cast<size_t>(command.getEncodedSize()));
  command.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

Row measure(int robots, const BenchArguments& arguments) {
  const server::ThreadLimit limit(arguments.threads);
  Row row;
  row.robots = robots;
  row.sim_s = arguments.duration_s > 0.0 ? arguments.duration_s : std::clamp(8000.0 / robots, 1.0, 1500.0);

  const auto load_begin = std::chrono::steady_clock::now();
  model::LoadOptions load_options;
  server::ServerOptions options;
  for (int robot = 0; robot < robots; ++robot) load_options.disabled.push_back(fmt::format("r{}/camera", robot));
  options.simulation.fleet.disabled = load_options.disabled;
  options.rate = std::numeric_limits<double>::infinity();
  options.duration_us = static_cast<int64_t>(row.sim_s * 1e6);
  options.control = false;
  const auto world = model::load_world_text(bench_world(robots), "rooms.sdf", load_options);
  std::unique_ptr<bus::LcmBus> lcm;
  if (!arguments.lcm.empty()) lcm = std::make_unique<bus::LcmBus>(arguments.lcm);
  std::unique_ptr<CountingSink> sink = lcm ? std::make_unique<CountingBus>(*lcm) : std::make_unique<CountingSink>();
  server::Server server(world, std::move(options), *sink);
  const std::vector<uint8_t> circle = circle_command();
  for (int robot = 0; robot < robots; ++robot) server.command(fmt::format("r{}/move", robot), circle);
  row.load_s = seconds_since(load_begin);

  const double cpu_begin = cpu_seconds();
  const auto begin = std::chrono::steady_clock::now();
  server.run();
  row.wall_s = seconds_since(begin);
  row.cpu_s = cpu_seconds() - cpu_begin;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  row.memory_mb = static_cast<double>(usage.ru_maxrss) / 1024.0;
  row.messages = sink->messages;
  row.bytes = sink->bytes;
  return row;
}

// A row in a process of its own, so that its memory is its own too; the row's line comes back through a pipe.
std::string measure_apart(int robots, const BenchArguments& arguments) {
  std::vector<std::string> words{"/proc/self/exe", "bench", "--one", "--robots", std::to_string(robots)};
  if (arguments.duration_s > 0.0) words.insert(words.end(), {"--duration", fmt::format("{}", arguments.duration_s)});
  if (arguments.threads > 0) words.insert(words.end(), {"--threads", std::to_string(arguments.threads)});
  if (!arguments.lcm.empty()) words.insert(words.end(), {"--lcm", arguments.lcm});
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  int ends[2];
  if (pipe(ends) != 0) throw EnvironmentError("no pipe could be made");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_addclose(&actions, ends[0]);
  pid_t child = 0;
  const int fault = posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (fault != 0) {
    close(ends[0]);
    throw EnvironmentError("the benchmark's process could not be started");
  }
  std::string line;
  char buffer[512];
  for (ssize_t count = 0; (count = read(ends[0], buffer, sizeof buffer)) > 0;) line.append(buffer, static_cast<size_t>(count));
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || line.empty()) {
    throw EnvironmentError(fmt::format("the run with {} robots did not finish", robots));
  }
  line.erase(line.find_last_not_of('\n') + 1);
  return line;
}

// A number out of one of our own JSON lines.
double value_of(const std::string& json, const std::string& key) {
  const size_t at = json.find('"' + key + "\": ");
  return at == std::string::npos ? 0.0 : std::stod(json.substr(at + key.size() + 4));
}

int run_bench(const BenchArguments& arguments) {
  std::vector<int> robots = arguments.robots;
  if (robots.empty()) robots.assign(kDefaultRobots.begin(), kDefaultRobots.end());
  if (!arguments.write_world.empty()) {
    std::ofstream file(arguments.write_world);
    file << bench_world(robots.front());
    if (!file.flush()) throw EnvironmentError(arguments.write_world + " cannot be written");
    return kGood;
  }
  if (arguments.one) {
    fmt::print("{}\n", to_json(measure(robots.front(), arguments)));
    return kGood;
  }
  const bool progress = isatty(STDERR_FILENO) != 0;
  if (!arguments.json) {
    fmt::print("{:>7} {:>12} {:>10} {:>10} {:>9} {:>12} {:>9}\n", "robots", "x real time", "sim s", "wall s", "CPU s", "messages/s", "memory");
  }
  for (const int count : robots) {
    if (progress) {
      fmt::print(stderr, "\r\033[K{} robots ...", count);
      std::fflush(stderr);
    }
    const std::string row = measure_apart(count, arguments);
    if (progress) fmt::print(stderr, "\r\033[K");
    if (arguments.json) {
      fmt::print("{}\n", row);
    } else {
      fmt::print("{:>7} {:>12.4g} {:>10.4g} {:>10.3g} {:>9.3g} {:>12.4g} {:>6.0f} MB\n", count, value_of(row, "real_time_factor"),
                 value_of(row, "sim_s"), value_of(row, "wall_s"), value_of(row, "cpu_s"),
                 value_of(row, "messages_per_sim_s") * value_of(row, "real_time_factor"), value_of(row, "memory_mb"));
    }
    std::fflush(stdout);
  }
  return kGood;
}

void add_bench(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("bench", "measure this machine: robots against real time");
  const auto arguments = std::make_shared<BenchArguments>();
  command->add_option("--robots", arguments->robots, "how many; several give several rows (default: 1 10 100 1000)")
      ->type_name("N")->check(CLI::Range(1, 100'000));
  command->add_option("--duration", arguments->duration_s, "simulated seconds (default: by the number of robots)")
      ->type_name("S")->check(CLI::Range(0.1, 1e6));
  command->add_option("--threads", arguments->threads, "most threads inside a module (default: one a core)")->type_name("N")->check(CLI::Range(1, 1024));
  command->add_option("--lcm", arguments->lcm, "put the messages on this LCM address (default: they are encoded and counted)")->type_name("URL");
  command->add_flag("--json", arguments->json, "a JSON object a line");
  command->add_option("--write-world", arguments->write_world, "write the world instead of running it")->type_name("FILE");
  command->add_flag("--one", arguments->one, "one row, in this process")->group("");
  command->callback([arguments, &chosen] { chosen = [arguments] { return run_bench(*arguments); }; });
}

const RegisterCommand kRegister{80, add_bench};

}  // namespace
}  // namespace ruedo::cli
