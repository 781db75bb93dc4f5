// How soon a command shows, and how evenly the loop runs: one P3-AT at --rate 1 that reports its
// motion at every step, and a client in another process, over LCM, as a user's would be.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/whole.h"
#include "bench/bench_rows.h"
#include "bus/lcm_bus.h"
#include "ruedo/errors.h"
#include "ruedo/motion_status_t.hpp"
#include "ruedo/move_command_t.hpp"
#include "run/run.h"
#include "system/end_with_parent.h"
#include "world/load.h"

namespace ruedo::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kWorld = R"(<sdf version="1.9"><world name="latency">
  <physics type="bullet"><max_step_size>0.005</max_step_size></physics>
  <include><uri>model://ground_plane</uri></include>
  <include><uri>model://p3at</uri><name>r</name></include></world></sdf>)";
// A command is lost after a second in which steps were heard, so that neither end loses any by
// being delayed; or where none are, as over an address that does not reach the client.
constexpr auto kLook = std::chrono::milliseconds(10);
constexpr int kLostLooks = 100, kDeafLooks = 1000;

double ms_between(Clock::time_point a, Clock::time_point b) {
  return std::chrono::duration<double, std::milli>(b - a).count();
}

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[whole<size_t>(part * static_cast<double>(values.size() - 1))];
}

std::string row_of(const char* table, const char* what, const std::vector<double>& values_ms,
                   int lost) {
  return fmt::format(
      "{{\"table\": \"{}\", \"what\": \"{}\", \"count\": {}, \"lost\": {}, \"median_ms\": {:.4g}, "
      "\"p99_ms\": {:.4g}, \"max_ms\": {:.4g}}}",
      table, what, values_ms.size(), lost, quantile(values_ms, 0.5), quantile(values_ms, 0.99),
      quantile(values_ms, 1.0));
}

// Notes when the motion of each step goes out.
class TimedBus : public Bus {
 public:
  TimedBus(Bus& bus, size_t most) : bus_(bus) { times_.reserve(most); }
  void publish(const std::string& channel, const uint8_t* data, size_t size) override {
    bus_.publish(channel, data, size);
    if (channel != "r/motion") return;
    motion_status_t motion;
    motion.decode(data, 0, static_cast<int>(size));
    times_.push_back({motion.utime, Clock::now()});
  }
  void listen(const std::vector<std::string>& channels, Handler handler,
              const std::vector<std::string>& own) override {
    bus_.listen(channels, std::move(handler), own);
  }
  void stop() override { bus_.stop(); }

  // How late each step is relative to the earliest one. Deadlines are absolute, so delays do not
  // add up.
  std::vector<double> lateness_ms() const {
    std::vector<double> late;
    for (const Sent& sent : times_)
      late.push_back(ms_between(times_[0].at, sent.at) - 1e-3 * static_cast<double>(sent.utime));
    const double first = late.empty() ? 0.0 : *std::min_element(late.begin(), late.end());
    for (double& each : late) each -= first;
    return late;
  }

 private:
  struct Sent {
    int64_t utime;
    Clock::time_point at;
  };
  Bus& bus_;
  std::vector<Sent> times_;
};

// Sends primitives at times that fall anywhere within a step; the first r/motion with a command's
// id is its effect.
class Client {
 public:
  explicit Client(const std::string& url) : bus_(url) {
    bus_.listen({"r/motion"}, [this](const std::string&, const uint8_t* data, size_t size) {
      motion_status_t motion;
      if (motion.decode(data, 0, static_cast<int>(size)) < 0) return;
      const Clock::time_point now = Clock::now();
      std::lock_guard lock(mutex_);
      if (motion.id != seen_) seen_at_ = now;
      seen_ = motion.id;
      ++heard_;
      changed_.notify_one();
    });
  }

  // angle_rad: of the turns; small ones are over when the next command comes, large ones are
  // replaced by it.
  std::string run(const char* what, double angle_rad, int commands) {
    wait_for(-1);  // until anything was heard
    std::vector<double> latency_ms;
    int lost = 0;
    for (int i = 1; i <= commands; ++i) {
      std::this_thread::sleep_for(std::chrono::microseconds(20'000 + 1'618 * i % 5'000));
      move_command_t command{};
      command.id = ++last_id_;
      command.kind = move_command_t::ROTATE;
      command.value = i % 2 ? angle_rad : -angle_rad;
      std::vector<uint8_t> bytes(static_cast<size_t>(command.getEncodedSize()));
      command.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
      const Clock::time_point sent = Clock::now();
      bus_.publish("r/move", bytes.data(), bytes.size());
      if (wait_for(command.id))
        latency_ms.push_back(ms_between(sent, seen_at_));
      else
        ++lost;
    }
    return row_of("latency", what, latency_ms, lost);
  }

 private:
  bool wait_for(int64_t id) {
    std::unique_lock lock(mutex_);
    for (int looks = 0; looks < kLostLooks;) {
      const int64_t before = heard_;
      if (changed_.wait_for(lock, kLook, [&] { return id < 0 ? seen_ >= 0 : seen_ == id; }))
        return true;
      deaf_looks_ = heard_ == before ? deaf_looks_ + 1 : 0;
      if (deaf_looks_ == 0 || deaf_looks_ > kDeafLooks) ++looks;
    }
    return false;
  }

  bus::LcmBus bus_;
  std::mutex mutex_;
  std::condition_variable changed_;
  int64_t seen_ = -1, last_id_ = 0, heard_ = 0;
  int deaf_looks_ = 0;  // in a row
  Clock::time_point seen_at_;
};

// The child's part; its rows go through the pipe.
int run_client(const std::string& url, int commands, int pipe) {
  try {
    Client client(url);
    std::string rows = client.run("command", 1e-5, commands) + "\n";
    rows += client.run("command that replaces a running one", 3.0, commands) + "\n";
    return write(pipe, rows.data(), rows.size()) == static_cast<ssize_t>(rows.size()) ? 0 : 1;
  } catch (const std::exception&) {
    return 1;  // the server's LcmBus reports what is wrong
  }
}

std::shared_ptr<const world::WorldModel> world_with_reports_at_every_step(
    const world::LoadOptions& options) {
  const auto world =
      std::make_shared<world::WorldModel>(*world::load_world_text(kWorld, "latency.sdf", options));
  for (world::ModelInstance& instance : world->models) {
    if (!instance.model->drive) continue;
    auto changed = std::make_shared<world::Model>(*instance.model);
    changed->drive->status_rate = Rate{0, 1};
    instance.model = changed;
  }
  return world;
}

}  // namespace

std::vector<std::string> measure_latency(const BenchTask& task) {
  const int commands =
      std::max(10, whole<int>((task.duration_s > 0.0 ? task.duration_s : 15.0) / 0.05));
  int ends[2];
  if (pipe(ends) != 0) throw EnvironmentError("no pipe could be made");
  const pid_t parent = getpid(), client = fork();
  if (client == 0) {
    end_with_parent(parent);
    _exit(run_client(task.lcm, commands, ends[1]));
  }
  close(ends[1]);
  if (client < 0) throw EnvironmentError("the benchmark's client could not be started");

  world::LoadOptions load;
  load.disabled = {"r/camera"};
  run::RunOptions options;
  options.control = false;
  options.simulation.fleet.disabled = load.disabled;
  bus::LcmBus lcm(task.lcm);
  TimedBus bus(lcm, 1'000'000);
  run::Run server(world_with_reports_at_every_step(load), std::move(options), bus);
  std::string text;
  int status = 0;
  std::thread ender([&] {
    char buffer[512];
    for (ssize_t count = 0; (count = read(ends[0], buffer, sizeof buffer)) > 0;)
      text.append(buffer, static_cast<size_t>(count));
    waitpid(client, &status, 0);
    server.stop();
  });
  server.run();
  ender.join();
  close(ends[0]);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw EnvironmentError("the benchmark's client did not finish");
  std::vector<std::string> rows;
  for (size_t at = 0; at < text.size();) {
    const size_t end = text.find('\n', at);
    rows.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  rows.push_back(row_of("pacing", "a step goes out late", bus.lateness_ms(), 0));
  return rows;
}

}  // namespace ruedo::bench
