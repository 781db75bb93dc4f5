// A run: the simulation, the bus, the log and the control of all of it.
//
// run() is the publisher: it takes finished batches in order, sends their messages, records them, executes
// requests between batches, and ends when the run does. Everything goes out from its thread, in one order.
#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "ruedo/bus.h"
#include "ruedo/state_reply_t.hpp"
#include "server/control.h"
#include "server/log_writer.h"
#include "server/simulation.h"
#include "server/tick.h"
#include "server/world_info.h"

namespace ruedo::server {

struct ServerOptions {
  SimulationOptions simulation;
  double rate = 1.0;                       // simulated per real time; +inf: as fast as it goes
  int64_t duration_us = -1;                // sim time; -1: without end
  bool paused = false;
  bool control = true;                     // serve ruedo/request
  std::string record;                      // file; "": none
  std::vector<std::string> result_options; // for the log's header
  std::vector<std::pair<std::string, std::string>> remaps;
};

// What has gone on so far, for a status line.
struct Status {
  int64_t step = -1;
  SimTime time_us = 0;
  uint64_t messages = 0;
  bool paused = false;
};

class Server {
 public:
  // The bus must outlive it. Throws InputError and EnvironmentError.
  Server(std::shared_ptr<const model::WorldModel> world, ServerOptions options, Bus& bus);
  ~Server();

  // Runs until the duration is over, stop(), or QUIT. Throws EnvironmentError when the log cannot be written any
  // more; the log is then whole up to there.
  void run();

  void stop();    // any thread

  // As if it had come over the bus: a command on one of the input channels. Any thread.
  void command(const std::string& channel, const std::vector<uint8_t>& bytes);

  const Channels& channels() const { return channels_; }
  const std::vector<world_info_t>& info() const { return info_; }
  const Findings& findings() const { return findings_; }
  int64_t run_id() const { return run_id_; }
  const CommandInbox& inbox() const { return simulation_->inbox(); }

  // Called by run() every half second of real time.
  void on_status(std::function<void(const Status&)> handler) { on_status_ = std::move(handler); }

 private:
  using Clock = std::chrono::steady_clock;

  void make_simulation();
  void begin_log();
  void listen();
  void publish(const Batch& batch);
  void publish_step(const Batch& batch, const Snapshot& snapshot);
  void tell_watchdogs(const Snapshot& snapshot);    // on the terminal, once a robot
  void record_applied(const Batch& batch, int64_t step);
  void publish_info();
  void check_log() const;
  template <class Message>
  void send(int channel, const Message& message);
  template <class Message>
  void record(const std::string& channel, int64_t utime, const Message& message);

  // Requests; in requests.cpp.
  Outcome execute(const request_t& request);
  Outcome step(const request_t& request);
  Outcome set_rate(const request_t& request);
  Outcome reset(const request_t& request);
  Outcome get_state(const request_t& request);
  Outcome reset_odometry(const request_t& request);
  state_reply_t state() const;
  static int64_t features();

  std::shared_ptr<const model::WorldModel> world_;
  ServerOptions options_;
  Bus& bus_;
  const int64_t run_id_;
  int32_t epoch_ = 0;
  Channels channels_;
  SimulationChannels own_;
  Findings findings_;
  Wakeup wakeup_;                              // a batch is finished, a request has come, or the end
  std::atomic<bool> stop_{false};
  std::unique_ptr<LogWriter> log_;
  SimTime log_base_us_ = 0;                    // log stamps never run backwards, whatever is reset
  std::unique_ptr<Pacer> pacer_;
  std::mutex simulation_mutex_;                // the bus's thread reaches the inbox through it
  std::unique_ptr<Simulation> simulation_;
  std::vector<world_info_t> info_;
  SampleClock tick_clock_, info_clock_;
  int64_t next_tick_ = 0, next_info_ = 0;      // steps
  int64_t ticks_ = 0, infos_ = 0;
  Clock::time_point last_info_;
  std::vector<int64_t> sequences_;             // messages on each channel in this epoch
  TickWriter tick_;
  std::vector<uint8_t> buffer_;
  std::vector<bool> watchdog_told_;            // of each robot
  const Snapshot* latest_ = nullptr;           // newest published state
  Status status_;
  std::function<void(const Status&)> on_status_;
  Control control_;
};

}  // namespace ruedo::server
