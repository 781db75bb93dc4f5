// A run: one world, its mode, its sinks, and the requests of its clients.
//
// run() is the publisher: it takes finished batches in order, hands their messages to the sinks,
// executes requests between batches, and ends when the run does. Everything goes out from its
// thread, in one order. The mode (mode.h) decides when it advances, the sinks (sink.h) take the
// messages, and the table in requests/requests.cpp has the function of each request.
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

#include "engine/edits/edits.h"
#include "engine/simulation.h"
#include "engine/world_info.h"
#include "ruedo/bus.h"
#include "ruedo/name_request_t.hpp"
#include "ruedo/rate_request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/snapshot_request_t.hpp"
#include "ruedo/state_reply_t.hpp"
#include "ruedo/step_request_t.hpp"
#include "run/backpressure.h"
#include "run/beats.h"
#include "run/journal.h"
#include "run/lockstep/lockstep.h"
#include "run/pacer.h"
#include "run/publisher.h"
#include "run/repeat/repeating.h"
#include "run/requests/control.h"
#include "run/requests/edited_world.h"
#include "run/requests/model_worker.h"
#include "run/requests/request_table.h"
#include "run/requests/saved_states.h"
#include "run/sinks.h"
#include "run/stall_watch.h"
#include "run/wait_for.h"

namespace ruedo::run {

struct RunOptions {
  engine::SimulationOptions simulation;
  double rate = 1.0;         // simulated per real time; +inf: as fast as it goes
  int64_t duration_us = -1;  // sim time; -1: without end
  bool paused = false;
  bool control = true;       // serve ruedo/request
  LockstepOptions lockstep;  // needs control
  std::string record;        // file; "": none
  int64_t record_limit = 0;  // bytes of all files that --record makes; 0: none
  bool edited = false;       // keeps the models' text, for editors of the world
  std::string save;          // file that SAVE writes; "": none
  std::string snapshots;     // folder that SNAPSHOT and RESTORE use; "": none
  std::vector<WaitForOption> wait_for;
  std::string repeat;            // log or snapshot to begin with: what acted on that run acts again
  bool end_with_repeat = false;  // and then end; else go on, and publish from there on
  Watcher watcher;               // sees what a log would get
  Bus::Handler hearer;           // sees each command and request before it is accepted, in the
                                 // thread that received it
  std::function<void()> before_model;  // for tests: called in the worker's thread before a SPAWN's
                                       // model is made ready
  std::vector<std::string> result_options;  // for the log's header
  std::vector<std::pair<std::string, std::string>> remaps;
};

// The progress of the run, for a status line.
struct Status {
  int64_t step = -1;
  SimTime time_us = 0;
  uint64_t messages = 0;
  bool paused = false;
  bool repeating = false;  // on the way to a snapshot: base/progress.h says how far
};

class Run {
 public:
  // The bus must outlive it. Throws InputError and EnvironmentError.
  Run(std::shared_ptr<const world::WorldModel> world, RunOptions options, Bus& bus);
  ~Run();

  // Runs until the duration is over, stop(), or QUIT. Throws EnvironmentError when the log cannot
  // be written any more, and LeaseEnded; the log is complete up to that point.
  void run();

  void stop();  // any thread, as the next
  bool stopping() const { return stop_; }

  // Another sink for the run's messages, beside the bus and the log. Before run(); it must outlive
  // the run.
  void add(Sink& sink) { publisher_.add(sink); }

  // A command on one of the input channels, or a request, from the bus or another transport. Its
  // bytes have not been checked. Any thread.
  void on_message(const std::string& channel, const uint8_t* data, size_t size);
  void on_message(const std::string& channel, const std::vector<uint8_t>& bytes) {
    on_message(channel, bytes.data(), bytes.size());
  }

  // From the program that launched this run: it is not left behind from now on. Any thread.
  void note_progress(const LauncherProgress& progress);
  // There is no such program, or none that says how far it is. Any thread.
  void follow_nobody();

  // Messages that the bus could not send, or that newer ones replaced on the way to a slow client.
  // Any thread.
  uint64_t lost() const { return bus_.failed() + bus_.replaced(); }

  const engine::Channels& channels() const { return channels_; }
  // The description of the world for clients; valid until models come or go.
  const std::vector<world_info_t>& info() const { return publisher_.announcement().info; }
  // The header of a log of this run; empty if nothing records, watches or repeats it.
  const log_header_t& log_header() const { return header_; }
  const Findings& findings() const { return findings_; }
  // The first error in what it is made of: in its devices, or in a model that came later.
  const std::optional<Finding>& first_error() const { return first_error_; }
  const world::BodyLayout& layout() const { return simulation_->layout(); }  // sinks may ask
  // The world as it is now: another object when models have come or gone. Any thread.
  std::shared_ptr<const world::WorldModel> world() {
    const std::lock_guard lock(simulation_mutex_);
    return world_;
  }
  int64_t run_id() const { return run_id_; }
  // SDF or URDF of a model of this world, as SPAWN takes it; "": not known. Any thread.
  std::string model_text(const std::string& name) const;
  const engine::CommandInbox& inbox() const { return simulation_->inbox(); }

  // Called by run() with each state that is published. Set before run().
  void on_state(std::function<void(const Snapshot&)> handler) { on_state_ = std::move(handler); }

  // Called with the reason when the run has stood still for two seconds; in any thread. Set before
  // run(). Without it the reason is logged.
  void on_stall(std::function<void(const std::string&)> handler) { on_stall_ = std::move(handler); }

  // Called by run() every half second of real time.
  void on_status(std::function<void(const Status&)> handler) { on_status_ = std::move(handler); }

 private:
  using Clock = std::chrono::steady_clock;
  using Outcome = engine::Outcome;
  friend class RequestTable;

  // The loop; in run.cpp.
  void add_sinks();
  void begin_log();
  Control::Host control_host();
  void publish_what_is_ready();
  bool has_room();
  bool launcher_wants_tick(int64_t step) const;
  void publish(const engine::Batch& batch);
  void record_applied(const engine::Batch& batch, int64_t step);
  void tell_readers();  // what is read by now
  bool compute_here();  // a few granted steps; false without one
  void serve();         // requests, and models that are ready
  Clock::time_point attend_follower(Clock::time_point now);
  Clock::time_point attend();  // does what is due by real time; returns when it is due next
  void tell_status();
  std::string why_idle();
  bool waits_for_launcher() const;
  std::string takes_no_messages() const;
  void finish();  // the run is over
  void say_ended();
  Status status() const;
  const world::ModelInstance& instance_of(RobotIndex robot) const;

  // The world and the mode in which it runs; in run_world.cpp.
  void make_world();  // again: what follows equals a fresh run
  struct Pace {
    double rate;
    bool paused;
  };
  void make_simulation(const Pace& pace);
  // The run continues in that mode from the state `step`; -1: from its beginning. With the
  // simulation's mutex held, as the next.
  void begin_mode(Mode& mode, int64_t step);
  void limit_pace();
  void begin_epoch();  // with a rebuilt world
  void announce();
  Mode::Stage stage();
  Mode& mode() { return repeating_ ? static_cast<Mode&>(*repeating_) : *mode_; }
  const Mode& mode() const { return repeating_ ? static_cast<const Mode&>(*repeating_) : *mode_; }
  void begin_repeat(std::unique_ptr<Repeating> repeating);
  void take_turn();          // the mode's tasks at this state
  std::string take_turns();  // why what is repeated broke off; "": it did not
  void end_repeat(bool paused);
  void break_repeat_off();  // the world stays where it is, paused

  // Requests; in requests/requests.cpp, and those of snapshots in snapshot_requests.cpp. Those of
  // clients go through admit(), those of a log are executed.
  Outcome admit(const request_t& request, const Session& session);
  Outcome execute(const request_t& request, const Session& session);
  bool serves(const RequestKind& kind) const;
  bool ends_restore(const RequestKind& kind) const;
  int64_t features() const;
  void note(const request_t& request);  // in the log: it changed the state
  void note_error(const std::vector<Finding>& findings);
  void note_files(const std::vector<std::string>&
                      files);  // that a model was read from which came since the start
  state_reply_t state() const;
  Outcome pause(const request_t&);
  Outcome resume(const request_t&);
  Outcome step(const request_t&, const step_request_t& body);
  Outcome set_rate(const request_t&, const rate_request_t& body);
  Outcome get_state(const request_t&, const name_request_t& body);
  Outcome say_info(const request_t&);
  Outcome quit(const request_t&);
  Outcome reset_odometry(const request_t& request, const name_request_t& body);
  Outcome get_joint_limits(const request_t&, const name_request_t& body);
  Outcome snapshot(const request_t& request);
  Outcome snapshot_of(const snapshot_request_t& past);
  Outcome restore(const request_t& request, const name_request_t& body);
  bool keeps_states() const;  // SNAPSHOT does, beside its files
  void keep_state(const std::string& path);
  bool stands_here();  // at the state that was published last
  Outcome restore_kept(const SavedState& saved, const std::string& path);

  // The state in a snapshot's file; in repeat/written_states.cpp.
  std::unique_ptr<engine::World> copy_of_world(uint64_t seed);
  std::vector<uint8_t>
  written_state();  // while the world stands still; empty: it cannot be written
  std::optional<SavedState> read_state(const std::string& path);  // none: run there again
  void begin_with_state();  // --restore, where the file has one

  // Requests that change the world between two steps; in requests/edit_requests.cpp.
  bool stand_still();  // false: the run is over
  void let_go();
  enum class Changes { states, models };  // models: some come or go
  // Applies a change to the world that stands still, and notes it.
  Outcome change(const request_t& request, Changes what, const std::function<Outcome()>& apply);
  void show_change();
  Outcome reset(const request_t& request, const reset_request_t& body);
  Outcome reset_all(const request_t& request, int64_t seed);
  Outcome reset_poses(const request_t& request);
  Outcome reset_time(const request_t& request);
  Outcome spawn(
      const request_t& request,
      const spawn_request_t& body);  // makes the model ready; of a log, puts it in at once
  void spawn_ready();                // puts in what is ready
  Outcome put_in(const request_t& request, const spawn_request_t& body,
                 const world::LoadedModel& loaded);
  Outcome remove(const request_t& request, const name_request_t& body);
  Outcome set_pose(const request_t& request, const set_pose_request_t& body);
  Outcome set_twist(const request_t& request, const set_twist_request_t& body);
  Outcome save(const request_t&);

  // Messages at fixed rates of sim time.
  struct Beats {
    HashBeat hashes;
    WatchdogWarnings watchdogs;
    Ticks ticks;
    InfoBeat info;
  };

  // The world that runs, and what clients know of it.
  const std::shared_ptr<const world::WorldModel> first_world_;  // as it was loaded
  std::shared_ptr<const world::WorldModel> world_;
  RunOptions options_;
  Bus& bus_;
  const int64_t run_id_;
  int32_t epoch_ = 0;
  bool as_made_ = true;  // no model came or went in this epoch, and sim time was not reset
  engine::Channels channels_;
  engine::SimulationChannels own_;
  std::string request_channel_;  // as it is called on the bus; "": none
  Findings findings_;
  std::optional<Finding> first_error_;
  engine::Wakeup wakeup_;  // a batch is finished, a request has come, or the end
  std::atomic<bool> stop_{false};

  // Its mode.
  std::mutex
      simulation_mutex_;  // of the world and the mode: commands reach them from other threads
  std::unique_ptr<Pacer> pacer_;
  Backpressure backpressure_;
  std::unique_ptr<engine::Simulation> simulation_;
  const std::unique_ptr<Mode> mode_;
  std::unique_ptr<Repeating> repeating_;  // before that mode; null: nothing is repeated
  Pace wanted_;                           // by the clients, once nothing is repeated

  // Its output.
  Publisher publisher_;
  uint64_t audience_ = UINT64_MAX;  // of the publisher, at the last update of read channels
  BusSink bus_sink_;
  std::unique_ptr<LogSink> log_;  // null: none, as the next two
  std::unique_ptr<WatcherSink> watcher_;
  std::unique_ptr<Journal> journal_;
  Beats beats_;
  log_header_t header_;       // of this epoch
  bool header_made_ = false;  // mere viewers (ROS 2, Foxglove) come later, and need none

  // The memory of SNAPSHOT, beside its files.
  SavedStates saved_states_;
  std::shared_ptr<engine::Plan> plan_of_saved_;  // of their worlds

  // Callbacks of the watcher in this process.
  std::function<void(const Status&)> on_status_;
  std::function<void(const std::string&)> on_stall_;
  std::function<void(const Snapshot&)> on_state_;
  Clock::time_point next_status_;

  // State that requests change.
  Snapshot changed_;                     // the last state, after requests
  std::unique_ptr<EditedWorld> edited_;  // null: it is not edited
  engine::ModelStore models_{first_world_->file};
  ModelWorker worker_;                     // of SPAWNs
  std::optional<ModelWorker::Made> made_;  // the next that is ready,
  int64_t enters_at_ = -1;                 // and the state that it waits for
  Control control_;
  StallWatch stall_watch_;
};

}  // namespace ruedo::run
