// The judge hears the run as a sink; the client, its pace and its end are seen to beside it.
#include "cli/support/judged_run.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <thread>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "base/progress.h"
#include "bus/server_bus.h"
#include "cli/support/client_pace.h"
#include "cli/support/client_process.h"
#include "log/header.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/decode.h"

namespace ruedo::cli {
namespace {

// Passes a run's states and messages to the judge.
class JudgeSink : public run::Sink {
 public:
  JudgeSink(judge::Judge& judge, run::Run& run) : judge_(judge), run_(run) {}

  Hears hears() const override { return {.samples = true, .records = true}; }
  bool wants(const std::string&) const override { return false; }  // no pictures
  void announce(const std::shared_ptr<const run::Announcement>& announcement) override {
    announcement_ = announcement;
    judge_.see_world(run_.world(), run_.layout());
  }
  void message(const run::Published& message) override {
    const std::span<const uint8_t> bytes(message.data, message.size);
    if (message.kind == run::Kind::sample) {
      judge_.see(announcement_->channels[message.index].name, bytes);
    } else if (message.channel == log::kAppliedChannel) {
      applied_t applied;
      if (decode_checked(bytes.data(), bytes.size(), applied) == DecodeFault::none)
        judge_.see(applied);
    }
  }

 private:
  judge::Judge& judge_;
  run::Run& run_;
  std::shared_ptr<const run::Announcement> announcement_;
};

// Ends a run that has not gone on for too long.
class Watchdog {
 public:
  Watchdog(double timeout_s, run::Run& run) : timeout_s_(timeout_s), run_(run) {
    run.on_stall([this](const std::string& reason) {
      const std::lock_guard lock(mutex_);
      reason_ = reason;
    });
    thread_ = std::thread([this] { watch(); });
  }
  ~Watchdog() {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  void moved() { ++moves_; }  // any thread

  // Why it has ended the run; "": it has not.
  std::string fault() {
    const std::lock_guard lock(mutex_);
    return fault_;
  }

 private:
  void watch() {
    std::unique_lock lock(mutex_);
    while (!over_) {
      const int64_t before = moves_;
      if (changed_.wait_for(lock, std::chrono::duration<double>(timeout_s_), [&] { return over_; }))
        return;
      if (moves_ != before) continue;
      fault_ = fmt::format("the run did not go on for {:g} s of real time{} (--timeout)",
                           timeout_s_, reason_.empty() ? "" : ": " + reason_);
      run_.stop();
      return;
    }
  }

  const double timeout_s_;
  run::Run& run_;
  std::atomic<int64_t> moves_{0};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string reason_, fault_;
  bool over_ = false;
  std::thread thread_;
};

// How the client has ended. until: sim time at its end, of a client that ended before the run.
judge::Check client_check(const JudgedRunOptions& options, const ClientProcess& client,
                          bool was_heard, std::optional<SimTime> until) {
  judge::Check check{"client", judge::Outcome::passed, "", {}};
  if (client.was_killed()) {
    check.outcome = judge::Outcome::failed;
    check.text = fmt::format(
        "the client was still running {:g} s after the end of the run (--grace), and was killed",
        options.grace_s);
  } else if (!client.fault().empty()) {
    check.outcome = judge::Outcome::failed;
    check.text = "the client ended with " + client.fault();
    if (!until) check.text += " after the end of the run";
  } else if (!was_heard && options.waits) {
    check.outcome = judge::Outcome::not_judged;
    check.text = fmt::format(
        "the client{} sent nothing on the bus (use --no-client-wait for a program that only "
        "listens)",
        client.was_told_to_end() ? "" : " ended with 0 and");
  } else if (client.was_told_to_end()) {
    check.text = "the client ran to the end, and ended at the signal to end";
  } else {
    check.text =
        until ? fmt::format("the client ended with 0 at {:g} s", static_cast<double>(*until) * 1e-6)
              : "the client ended with 0 after the end of the run";
  }
  return check;
}

// A run that a client's pace holds, until it goes, however it ends.
class Paced {
 public:
  Paced(ClientPace& pace, run::Run* run) : pace_(pace) { pace_.pace(run); }
  ~Paced() { pace_.pace(nullptr); }
  Paced(const Paced&) = delete;
  Paced& operator=(const Paced&) = delete;

 private:
  ClientPace& pace_;
};

// Null: the run has none.
std::unique_ptr<ClientProcess> start_client(const JudgedRunOptions& options, const bus::LcmUrl& url,
                                            ClientPace& pace, std::function<void()> at_end) {
  if (options.client.empty()) return nullptr;
  return std::make_unique<ClientProcess>(
      options.client,
      std::vector<std::string>{"LCM_DEFAULT_URL=" + url.str(), "RUEDO_REGRESS=1", pace.variable()},
      std::move(at_end), std::vector<int>{pace.inherited()});
}

}  // namespace

judge::Check world_check(const Finding& error) {
  return {"world",
          judge::Outcome::failed,
          fmt::format("the world has an error, {}: {}: {} (--allow-errors runs it as it is)",
                      error.source.str(), error.element, error.text),
          {}};
}

std::vector<judge::Check> run_judged(const std::shared_ptr<const world::WorldModel>& world,
                                     JudgedRunOptions options, judge::Judge& judge,
                                     SignalThread& signals) {
  const bus::ServerBus place =
      bus::open_server_bus(options.isolated ? "auto" : "auto-tcp", world->name,
                           [](const std::string& line) { spdlog::warn(line); });
  const bool has_client = !options.client.empty();
  ClientPace pace(has_client && options.waits);
  options.run.hearer = [&pace](const std::string&, const uint8_t*, size_t) { pace.heard(); };
  Progress progress("running " + world->name, options.run.duration_us);
  options.run.wait_for = with_channels(std::move(options.run.wait_for), *world, options.ros2);
  std::unique_ptr<Ros2Network> network = Ros2Network::open(options.ros2);
  run::Run server(world, std::move(options.run), *place.bus);
  const std::unique_ptr<Ros2Node> node = Ros2Node::open(server, options.ros2, std::move(network));
  JudgeSink sink(judge, server);
  server.add(sink);
  Watchdog watchdog(options.timeout_s, server);
  std::atomic<SimTime> now{0};
  std::atomic<bool> client_is_over{false}, awaits_peers{!options.ros2.wait_for.empty()};
  server.on_state([&](const Snapshot& snapshot) {
    judge.see(snapshot);
    now = snapshot.time;
    if (client_is_over && snapshot.time > 0) server.stop();
    watchdog.moved();
    progress.to(snapshot.time);
  });
  const Paced paced(pace, has_client ? &server : nullptr);
  std::atomic<SimTime> ended_at{-1};
  const std::unique_ptr<ClientProcess> client = start_client(options, place.url, pace, [&] {
    ended_at = now.load();
    // A run that waits for no client may not have begun: it has one step at least.
    client_is_over = true;
    if (options.waits || awaits_peers || now > 0) server.stop();
  });
  std::vector<judge::Check> checks;
  const SignalThread::Serving serving(signals, server);
  try {
    if (node) node->wait_for_peers();
    awaits_peers = false;
    server.run();
  } catch (const run::LeaseEnded& ended) {
    checks.push_back({"run", judge::Outcome::failed, ended.what(), {}});
  }
  if (std::string fault = watchdog.fault(); !fault.empty())
    checks.push_back({"run", judge::Outcome::failed, std::move(fault), {}});
  pace.pace(nullptr);
  if (server.first_error() && !options.allow_errors)
    checks.push_back(world_check(*server.first_error()));
  if (client) {
    const bool by_itself = client->is_over();
    client->end(std::chrono::duration<double>(signals.told() ? 0.0 : options.grace_s));
    checks.push_back(client_check(options, *client, pace.was_heard(),
                                  by_itself ? std::optional(ended_at.load()) : std::nullopt));
  }
  return checks;
}

}  // namespace ruedo::cli
