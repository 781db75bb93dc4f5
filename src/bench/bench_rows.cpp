// Runs the benchmark's world as fast as it goes, and counts what comes out.
#include "bench/bench_rows.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "base/whole.h"
#include "bench/bench_world.h"
#include "bus/lcm_bus.h"
#include "engine/thread_limit.h"
#include "ruedo/move_command_t.hpp"
#include "run/run.h"
#include "world/load.h"

namespace ruedo::bench {
namespace {

using Table = BenchTask::Table;

// Takes every message, encoded as it goes out, and counts it; with a bus, passes it on.
class CountingBus : public Bus {
 public:
  explicit CountingBus(Bus* bus) : bus_(bus) {}
  void publish(const std::string& channel, const uint8_t* data, size_t size) override {
    ++messages;
    bytes += size;
    pictures += channel.ends_with("/camera");
    if (bus_) bus_->publish(channel, data, size);
  }
  void listen(const std::vector<std::string>& channels, Handler handler,
              const std::vector<std::string>& own) override {
    if (bus_) bus_->listen(channels, std::move(handler), own);
  }
  void stop() override {
    if (bus_) bus_->stop();
  }

  uint64_t messages = 0, bytes = 0, pictures = 0;

 private:
  Bus* bus_;
};

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

rusage usage() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage;
}

double cpu_seconds() {
  const rusage now = usage();
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(now.ru_utime) + seconds(now.ru_stime);
}

// In its circle for ever: a primitive need not be repeated.
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

// A few seconds of a modern machine.
double default_duration_s(const BenchTask& task) {
  return task.table == Table::camera ? 20.0 / task.robots
                                     : std::clamp(8000.0 / task.robots, 1.0, 1500.0);
}

}  // namespace

const char* name_of(Table table) {
  constexpr const char* kNames[] = {"robots", "lcm", "camera", "latency", "rays"};
  return kNames[static_cast<int>(table)];
}

std::vector<std::string> measure(const BenchTask& task) {
  if (task.table == Table::latency) return measure_latency(task);
  if (task.table == Table::rays) return measure_rays(task);
  const engine::ThreadLimit limit(task.threads);
  const double sim_s = task.duration_s > 0.0 ? task.duration_s : default_duration_s(task);

  const auto load_begin = std::chrono::steady_clock::now();
  world::LoadOptions load_options;
  run::RunOptions options;
  if (task.table != Table::camera) {
    for (int robot = 0; robot < task.robots; ++robot)
      load_options.disabled.push_back(fmt::format("r{}/camera", robot));
  }
  options.simulation.fleet.disabled = load_options.disabled;
  options.rate = std::numeric_limits<double>::infinity();
  options.duration_us = microseconds(sim_s);
  options.control = false;
  const auto world = world::load_world_text(bench_world(task.robots), "rooms.sdf", load_options);
  std::unique_ptr<bus::LcmBus> lcm;
  if (task.table == Table::lcm) lcm = std::make_unique<bus::LcmBus>(task.lcm);
  CountingBus sink(lcm.get());
  run::Run server(world, std::move(options), sink);
  const std::vector<uint8_t> circle = circle_command();
  for (int robot = 0; robot < task.robots; ++robot)
    server.on_message(fmt::format("r{}/move", robot), circle);
  const double load_s = seconds_since(load_begin);

  const double cpu_begin = cpu_seconds();
  const auto begin = std::chrono::steady_clock::now();
  server.run();
  const double wall_s = seconds_since(begin), cpu_s = cpu_seconds() - cpu_begin;
  return {fmt::format(
      "{{\"table\": \"{}\", \"simulator\": \"Ruedo\", \"robots\": {}, \"real_time_factor\": "
      "{:.6g}, \"sim_s\": {:.6g}, "
      "\"wall_s\": {:.6g}, \"cpu_s\": {:.6g}, \"load_s\": {:.6g}, \"memory_mb\": {:.6g}, "
      "\"step_ms\": 5, "
      "\"messages_per_sim_s\": {:.6g}, \"bytes_per_sim_s\": {:.6g}, \"pictures_per_s\": {:.6g}}}",
      name_of(task.table), task.robots, sim_s / wall_s, sim_s, wall_s, cpu_s, load_s,
      static_cast<double>(usage().ru_maxrss) / 1024.0, static_cast<double>(sink.messages) / sim_s,
      static_cast<double>(sink.bytes) / sim_s, static_cast<double>(sink.pictures) / wall_s)};
}

double value_of(const std::string& row, const std::string& key) {
  const size_t at = row.find('"' + key + "\": ");
  return at == std::string::npos ? 0.0 : std::stod(row.substr(at + key.size() + 4));
}

}  // namespace ruedo::bench
