// ruedo bench: what this machine does. Robots against real time, each with an LRF, sixteen sonars
// and odometry in rooms with contacts; the same with the messages on LCM; cameras; the latency of
// commands and the pacing of the loop; rays. docs/performance.md says what the figures mean.
#include <algorithm>
#include <cstdio>
#include <memory>

#include <fmt/format.h>

#include "base/progress.h"
#include "bench/bench_rows.h"
#include "bench/bench_world.h"
#include "cli/support/commands.h"
#include "cli/support/range.h"
#include "ruedo/errors.h"
#include "system/output_file.h"
#include "system/program_output.h"
#include "system/to_stderr.h"

namespace ruedo::bench {
namespace {

using Table = BenchTask::Table;

// A port that no simulation uses by default; nothing leaves the machine.
constexpr const char* kBenchUrl = "udpm://239.255.76.67:7691?ttl=0";

struct BenchArguments {
  std::vector<int> robots;
  std::vector<std::string> only;
  double duration_s = 0.0;
  int threads = 0;
  bool json = false, one = false;
  std::string lcm, write_world;
};

bool is_run(const BenchArguments& arguments, Table table) {
  if (!arguments.only.empty())
    return std::find(arguments.only.begin(), arguments.only.end(), name_of(table)) !=
           arguments.only.end();
  if (table == Table::robots) return arguments.lcm.empty() || arguments.robots.empty();
  if (table == Table::lcm) return !arguments.lcm.empty() || arguments.robots.empty();
  return arguments.robots.empty();
}

std::vector<BenchTask> tasks_of(const BenchArguments& arguments) {
  const std::string url = arguments.lcm.empty() ? kBenchUrl : arguments.lcm;
  std::vector<BenchTask> tasks;
  const auto add = [&](Table table, std::vector<int> by_default) {
    if (!is_run(arguments, table)) return;
    for (const int robots :
         table != Table::latency && !arguments.robots.empty() ? arguments.robots : by_default) {
      tasks.push_back({table, robots, arguments.duration_s, arguments.threads, url});
    }
  };
  add(Table::robots, {1, 10, 100, 1000});
  add(Table::lcm, {1, 10, 100, 1000});
  add(Table::camera, {1, 2, 4});
  add(Table::latency, {1});
  add(Table::rays, {1, 100, 1000});
  return tasks;
}

std::string heading_of(Table table) {
  switch (table) {
    case Table::robots: return "Robots, messages encoded and counted";
    case Table::lcm: return "Robots, messages on LCM";
    case Table::camera: return "Robots with a camera each, 640 x 480 at 15 Hz";
    case Table::latency: return "One robot at --rate 1, step 5 ms, over LCM";
    case Table::rays:
      return "Rays on one core: scans of 181, 8 m, in the rooms of so many robots; bare Embree in "
             "the same run";
  }
  return "";
}

void print_head(Table table) {
  fmt::print("{}\n", heading_of(table));
  if (table == Table::latency) {
    fmt::print("  {:<42} {:>7} {:>10} {:>10} {:>10}\n", "", "count", "median ms", "99 % ms",
               "largest");
  } else if (table == Table::rays) {
    fmt::print("  {:>7} {:>14} {:>14} {:>9} {:>14}\n", "robots", "million rays/s", "bare Embree",
               "ratio", "difference m");
  } else {
    fmt::print("  {:>7} {:>12} {:>9} {:>9} {:>9} {:>11} {:>10} {:>9}\n", "robots", "x real time",
               "sim s", "wall s", "CPU s", table == Table::camera ? "pictures/s" : "messages/s",
               "loading s", "memory");
  }
}

void print_row(Table table, const std::string& row) {
  const auto value = [&](const char* key) { return value_of(row, key); };
  if (table == Table::latency) {
    const size_t from = row.find("\"what\": \"") + 9;
    fmt::print("  {:<42} {:>7.0f} {:>10.3g} {:>10.3g} {:>10.3g}\n",
               row.substr(from, row.find('"', from) - from), value("count"), value("median_ms"),
               value("p99_ms"), value("max_ms"));
    if (value("lost") > 0) fmt::print("  {:.0f} of them were lost\n", value("lost"));
  } else if (table == Table::rays) {
    fmt::print("  {:>7.0f} {:>14.3g} {:>14.3g} {:>9.3g} {:>14.2g}\n", value("robots"),
               1e-6 * value("rays_per_s"), 1e-6 * value("embree_rays_per_s"),
               value("ratio_to_embree"), value("largest_difference_m"));
  } else {
    fmt::print("  {:>7.0f} {:>12.4g} {:>9.4g} {:>9.3g} {:>9.3g} {:>11.4g} {:>10.3g} {:>6.0f} MB\n",
               value("robots"), value("real_time_factor"), value("sim_s"), value("wall_s"),
               value("cpu_s"),
               table == Table::camera ? value("pictures_per_s")
                                      : value("messages_per_sim_s") * value("real_time_factor"),
               value("load_s"), value("memory_mb"));
  }
  std::fflush(stdout);
}

int run_all(const BenchArguments& arguments) {
  const std::vector<BenchTask> tasks = tasks_of(arguments);
  int code = cli::kGood;
  for (size_t i = 0; i < tasks.size(); ++i) {
    const Table table = tasks[i].table;
    std::vector<std::string> rows;
    std::string fault;
    try {
      const Progress task(fmt::format("measuring {}, {} robot{} ({} of {})", name_of(table),
                                      tasks[i].robots, tasks[i].robots == 1 ? "" : "s", i + 1,
                                      tasks.size()));
      rows = measure_apart(tasks[i]);
    } catch (const EnvironmentError&
                 error) {  // no multicast, say, or no renderer: the other tables are still good
      fault = error.what();
      code = cli::kEnvironment;
    }
    if (!arguments.json && (i == 0 || tasks[i - 1].table != table)) {
      if (i > 0) fmt::print("\n");
      print_head(table);
    }
    if (!fault.empty()) to_stderr("{}\n", fault);
    for (const std::string& row : rows) {
      if (arguments.json)
        fmt::print("{}\n", row);
      else
        print_row(table, row);
    }
    std::fflush(stdout);
  }
  return code;
}

// The child of measure_apart().
int run_one(const BenchArguments& arguments) {
  const std::vector<BenchTask> tasks = tasks_of(arguments);
  for (const std::string& row : measure(tasks.front())) fmt::print("{}\n", row);
  return cli::kGood;
}

int run_bench(const BenchArguments& arguments) {
  if (!arguments.write_world.empty()) {
    write_file(arguments.write_world,
               bench_world(arguments.robots.empty() ? 1 : arguments.robots.front()));
    return cli::kGood;
  }
  return arguments.one ? run_one(arguments) : run_all(arguments);
}

void add_bench(CLI::App& app, cli::Action& chosen) {
  CLI::App* command = app.add_subcommand(
      "bench", "measure this machine: robots against real time, LCM, cameras, latency, rays");
  const auto arguments = std::make_shared<BenchArguments>();
  command
      ->add_option("--robots", arguments->robots,
                   "how many; several give several rows, of the first table alone (default: all "
                   "tables, 1 10 100 1000)")
      ->type_name("N")
      ->check(CLI::Range(1, 100'000));
  command
      ->add_option("--only", arguments->only,
                   "tables to measure: robots, lcm, camera, latency, rays")
      ->type_name("TABLE")
      ->check(CLI::IsMember({"robots", "lcm", "camera", "latency", "rays"}));
  command
      ->add_option("--duration", arguments->duration_s,
                   "simulated seconds (default: by the number of robots)")
      ->type_name("S")
      ->check(cli::within(0.1, 1e6));
  command
      ->add_option("--threads", arguments->threads,
                   "maximum number of threads in a module (default: one per core)")
      ->type_name("N")
      ->check(CLI::Range(1, 1024));
  command
      ->add_option("--lcm", arguments->lcm,
                   std::string("LCM address of the tables with LCM (default: ") + kBenchUrl + ")")
      ->type_name("URL");
  command->add_flag("--json", arguments->json, "a JSON object a line");
  command
      ->add_option("--write-world", arguments->write_world, "write the world instead of running it")
      ->type_name("FILE");
  command->add_flag("--one", arguments->one, "one row, in this process")->group("");
  command->callback(
      [arguments, &chosen] { chosen = [arguments] { return run_bench(*arguments); }; });
}

const cli::RegisterCommand kRegister{80, add_bench};

}  // namespace

// The row's lines come back through a pipe; the child reports errors on stderr.
std::vector<std::string> measure_apart(const BenchTask& task) {
  std::vector<std::string> words{"/proc/self/exe",    "bench", "--one", "--quiet", "--only",
                                 name_of(task.table), "--lcm", task.lcm};
  words.insert(words.end(), {"--robots", std::to_string(task.robots)});
  if (task.duration_s > 0.0)
    words.insert(words.end(), {"--duration", fmt::format("{}", task.duration_s)});
  if (task.threads > 0) words.insert(words.end(), {"--threads", std::to_string(task.threads)});
  const auto text = output_of(std::move(words), ItsErrors::shown);
  if (!text || text->empty()) {
    throw EnvironmentError(fmt::format("the measurement '{}' with {} robots did not finish",
                                       name_of(task.table), task.robots));
  }
  std::vector<std::string> rows;
  for (size_t at = 0; at < text->size();) {
    const size_t end = std::min(text->find('\n', at), text->size());
    rows.push_back(text->substr(at, end - at));
    at = end + 1;
  }
  return rows;
}

}  // namespace ruedo::bench
