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
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ruedo/bus.h"
#include "ruedo/state_reply_t.hpp"
#include "run/beats.h"
#include "run/control.h"
#include "engine/edits.h"
#include "run/lockstep.h"
#include "run/model_worker.h"
#include "run/journal.h"
#include "run/publisher.h"
#include "run/replay.h"
#include "engine/simulation.h"
#include "run/sinks.h"
#include "run/wait_for.h"
#include "engine/world_info.h"

namespace ruedo::run {

struct ServerOptions {
  engine::SimulationOptions simulation;
  double rate = 1.0;                       // simulated per real time; +inf: as fast as it goes
  int64_t duration_us = -1;                // sim time; -1: without end
  bool paused = false;
  bool control = true;                     // serve ruedo/request
  LockstepOptions lockstep;                // wants control
  std::string record;                      // file; "": none
  std::string snapshots;                   // folder that SNAPSHOT and RESTORE use; "": none
  std::vector<WaitForOption> wait_for;
  std::string repeat;                      // log or snapshot to begin with: what acted on that run acts again
  bool end_with_repeat = false;            // and then end; else go on, and publish from there on
  Watcher watcher;               // sees what a log would get
  std::function<void()> before_model;      // for tests: called in the worker's thread before a SPAWN's model is made ready
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
  // more, and LeaseEnded; the log is then whole up to there.
  void run();

  void stop();    // any thread
  bool stopping() const { return stop_; }

  // Another sink for the run's messages, beside the bus and the log. Before run(); it must outlive the run.
  void add(Sink& sink) { publisher_.add(sink); }

  // A command on one of the input channels, or a request, as it would come over the bus: bytes that nobody has checked. For the
  // bus and for whatever else clients speak. Any thread.
  void receive(const std::string& channel, const uint8_t* data, size_t size);
  void receive(const std::string& channel, const std::vector<uint8_t>& bytes) { receive(channel, bytes.data(), bytes.size()); }

  const engine::Channels& channels() const { return channels_; }
  // What clients are told of the world; until models come or go.
  const std::vector<world_info_t>& info() const { return publisher_.announcement().info; }
  const Findings& findings() const { return findings_; }
  // The world as it is now: another object when models have come or gone. Any thread.
  std::shared_ptr<const model::WorldModel> world() {
    const std::lock_guard lock(simulation_mutex_);
    return world_;
  }
  int64_t run_id() const { return run_id_; }
  const engine::CommandInbox& inbox() const { return simulation_->inbox(); }

  // Called by run() with each state that is published. Set before run().
  void on_state(std::function<void(const Snapshot&)> handler) { on_state_ = std::move(handler); }

  // Called by run() every half second of real time.
  void on_status(std::function<void(const Status&)> handler) { on_status_ = std::move(handler); }

 private:
  using Clock = std::chrono::steady_clock;

  void add_sinks();
  void make_simulation();
  void announce();
  void publish(const engine::Batch& batch);
  void publish_step(const engine::Batch& batch, const Snapshot& snapshot);
  void check_leases();    // of lockstep
  void drain();           // lets clients in lockstep fetch what they have lost
  void tell_watchdog(size_t robot);                 // on the terminal
  void record_applied(const engine::Batch& batch, int64_t step);
  Status status() const;
  void tell_wait();                                 // for whom the run waits, once a second has passed
  void add_applied(TickWriter& tick, int64_t step);

  // Repeating what is in a log; in repeat.cpp.
  void begin_repeat(const std::string& path);    // throws InputError
  void repeat();                                 // after each state: what acts on it, and the end
  void repeat_request(const applied_t& applied);
  void end_repeat();
  void go_on(bool paused);
  int input_of(const applied_t& applied) const;
  engine::Outcome snapshot(const request_t& request);
  engine::Outcome restore(const request_t& request);

  // Requests; in requests.cpp.
  engine::Outcome ask(const request_t& request, const Session& session);
  engine::Outcome execute(const request_t& request);
  void note(const request_t& request);           // in the log: it changed the state
  void note_files(const std::vector<std::string>& files);    // that a model was read from which came since the start
  void begin_epoch();                            // the world is made anew
  engine::Outcome pause();
  engine::Outcome step(const request_t& request);
  engine::Outcome set_rate(const request_t& request);
  engine::Outcome reset(const request_t& request);
  engine::Outcome get_state(const request_t& request);
  engine::Outcome reset_odometry(const request_t& request);
  // Changes between two steps; in edit_requests.cpp.
  bool stand_still();                            // false: the run is over
  void move_on();
  // Applies a change to the world that stands still, and notes it. models: some come or go.
  engine::Outcome change(const request_t& request, bool models, const std::function<engine::Outcome()>& apply);
  engine::Outcome edit(const request_t& request);
  engine::Outcome spawn(const request_t& request);       // makes the model ready; in a repetition, puts it in at once
  void spawn_ready();                            // puts in what is ready
  engine::Outcome put_in(const request_t& request, const spawn_request_t& body, const model::LoadedModel& loaded);
  engine::Outcome reset_poses(const request_t& request);
  engine::Outcome reset_time(const request_t& request);
  state_reply_t state() const;
  int64_t features() const;

  const std::shared_ptr<const model::WorldModel> first_world_;    // as it was loaded
  std::shared_ptr<const model::WorldModel> world_;
  ServerOptions options_;
  Bus& bus_;
  const int64_t run_id_;
  int32_t epoch_ = 0;
  engine::Channels channels_;
  engine::SimulationChannels own_;
  std::string request_channel_;                        // as it is called on the bus; "": none
  Findings findings_;
  engine::Wakeup wakeup_;                              // a batch is finished, a request has come, or the end
  std::atomic<bool> stop_{false};
  Publisher publisher_;
  BusSink bus_sink_;
  std::unique_ptr<LogSink> log_;               // null: none, as the next two
  std::unique_ptr<WatcherSink> watcher_;
  std::unique_ptr<Journal> journal_;
  log_header_t header_;                        // of this epoch
  std::unique_ptr<Replay> replay_;             // while something is repeated: commands and requests wait outside
  std::atomic<bool> repeating_{false};         // the same for the bus's thread
  SimTime repeat_begin_us_ = 0;                // stamp at which it began
  struct { double rate; bool paused; } after_repeat_{};
  std::unique_ptr<Pacer> pacer_;
  std::mutex simulation_mutex_;                // the bus's thread reaches the inbox through it
  std::unique_ptr<engine::Simulation> simulation_;
  std::unique_ptr<WaitFor> wait_for_;          // null: for nobody
  int64_t wait_step_ = -1;                     // the run has been at this step
  Clock::time_point wait_begin_;               // since then
  bool wait_told_ = false;
  Ticks ticks_;
  InfoBeat info_beat_;
  HashBeat hashes_;
  WatchdogWarnings watchdogs_;
  Snapshot changed_;
  engine::ModelStore models_{first_world_->file};
  ModelWorker worker_;                         // of SPAWNs
  std::optional<ModelWorker::Made> made_;      // the next that is ready,
  int64_t enters_at_ = -1;                     // and the state that it waits for
  std::function<void(const Status&)> on_status_;
  std::function<void(const Snapshot&)> on_state_;
  std::unique_ptr<Lockstep> lockstep_;         // null: the run goes by itself
  Control control_;
};

}  // namespace ruedo::run
