// Command-to-effect latency over LCM, and the jitter of the paced loop, of one P3-AT that runs at --rate 1 and reports
// its motion at every step. The client is another process (a fork, before any thread starts), as a user's would be.
//
//   unshare -rn sh -c 'ip link set lo up; ip route add 224.0.0.0/4 dev lo; exec bench_latency [commands]'
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

#include <lcm/lcm-cpp.hpp>

#include "bus/lcm_bus.h"
#include "model/load.h"
#include "ruedo/motion_status_t.hpp"
#include "ruedo/move_command_t.hpp"
#include "server/server.h"

namespace {

using namespace ruedo;
using Clock = std::chrono::steady_clock;

constexpr const char* kUrl = "udpm://239.255.76.67:7691?ttl=0";
constexpr double kStep_ms = 5.0;

constexpr const char* kWorld = R"(<sdf version="1.9" xmlns:ruedo="ruedo"><world name="latency">
  <physics type="bullet"><max_step_size>0.005</max_step_size></physics>
  <include><uri>model://ground_plane</uri></include>
  <include><uri>model://p3at</uri><name>r</name></include></world></sdf>)";

double ms_between(Clock::time_point a, Clock::time_point b) { return std::chrono::duration<double, std::milli>(b - a).count(); }

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(part * static_cast<double>(values.size() - 1))];
}

void report(const char* what, const std::vector<double>& values) {
  std::printf("%-44s %6zu values  median %7.3f ms   99 %% %7.3f ms   largest %7.3f ms\n", what, values.size(), quantile(values, 0.5),
              quantile(values, 0.99), quantile(values, 1.0));
}

// Notes when the motion of each step goes out.
class TimedBus : public Bus {
 public:
  explicit TimedBus(Bus& bus) : bus_(bus) { times_.reserve(1'000'000); }
  void publish(const std::string& channel, const uint8_t* data, size_t size) override {
    bus_.publish(channel, data, size);
    if (channel != "r/motion") return;
    motion_status_t motion;
    motion.decode(data, 0, static_cast<int>(size));
    times_.push_back({motion.utime, Clock::now()});
  }
  void listen(const std::vector<std::string>& channels, Handler handler, const std::vector<std::string>& own) override {
    bus_.listen(channels, std::move(handler), own);
  }
  void stop() override { bus_.stop(); }

  // How late each step is against the earliest one: the pacing is k steps after k steps' time, so this does not add up.
  std::vector<double> lateness_ms() const {
    std::vector<double> late;
    for (const Sent& sent : times_) late.push_back(ms_between(times_[0].at, sent.at) - 1e-3 * static_cast<double>(sent.utime));
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

// Sends primitives at times that fall anywhere within a step; the first r/motion with a command's id is its effect.
int run_client(int commands) {
  lcm::LCM lcm(kUrl);
  if (!lcm.good()) return 1;
  int64_t seen = -1;
  bool heard = false;
  const lcm::LCM::HandlerFunction<motion_status_t> on_motion = [&](const lcm::ReceiveBuffer*, const std::string&, const motion_status_t* motion) {
    seen = motion->id;
    heard = true;
  };
  lcm.subscribe("r/motion", on_motion);
  while (!heard) lcm.handle();
  std::vector<double> latency_ms;
  int lost = 0;
  for (int id = 1; id <= commands; ++id) {
    const auto pause = std::chrono::microseconds(20'000 + 1'618 * id % 5'000);
    for (const auto until = Clock::now() + pause; Clock::now() < until;) lcm.handleTimeout(1);
    move_command_t command{};
    command.id = id;
    command.kind = move_command_t::ROTATE;
    command.value = id % 2 ? 1e-5 : -1e-5;    // over when the next comes: the end of a replaced one would be shown first
    const auto sent = Clock::now();
    lcm.publish("r/move", &command);
    while (seen != id && ms_between(sent, Clock::now()) < 1000.0) lcm.handleTimeout(100);
    if (seen == id) latency_ms.push_back(ms_between(sent, Clock::now()));
    else ++lost;
  }
  report("command published to first motion with it", latency_ms);
  std::printf("lost: %d; wanted: median below %.1f ms, 99 %% below %.1f ms\n", lost, kStep_ms + 0.5, 2 * kStep_ms);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const int commands = argc > 1 ? std::atoi(argv[1]) : 400;
  const pid_t client = fork();
  if (client == 0) {
    const int code = run_client(commands);
    std::fflush(stdout);
    _exit(code);
  }
  model::LoadOptions load;
  load.disabled = {"r/camera"};
  server::ServerOptions options;
  options.control = false;
  options.simulation.fleet.disabled = load.disabled;
  const auto world = std::make_shared<model::WorldModel>(*model::load_world_text(kWorld, "latency.sdf", load));
  // Status at every step, as <ruedo:status_rate>0</ruedo:status_rate> in the model gives it.
  for (model::ModelInstance& instance : world->models) {
    if (!instance.model->drive) continue;
    auto changed = std::make_shared<model::Model>(*instance.model);
    changed->drive->status_rate = Rate{0, 1};
    instance.model = changed;
  }
  bus::LcmBus lcm(kUrl);
  TimedBus bus(lcm);
  server::Server server(world, std::move(options), bus);
  int status = 0;
  std::thread ender([&] {
    waitpid(client, &status, 0);
    server.stop();
  });
  server.run();
  ender.join();
  report("loop: how late a step is published", bus.lateness_ms());
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}
