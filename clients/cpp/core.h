// A connection: what is known of the simulation, its streams, its robots' commands, and its
// session.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "callbacks/callback_faults.h"
#include "callbacks/callback_queue.h"
#include "callbacks/callbacks.h"
#include "driver.h"
#include "lockstep/stepper.h"
#include "progress.h"
#include "ruedo/client.h"
#include "run_watch.h"
#include "samples/world_info.h"
#include "session.h"
#include "sim_clock.h"
#include "standstill.h"
#include "stream_core.h"
#include "transport/bus.h"
#include "transport/forked.h"

namespace ruedo::client {

class ServerProcess;

using Clock = std::chrono::steady_clock;
Clock::time_point deadline_after(Duration time);  // kForever: never
std::string text_of(double number);               // as a user wrote it: 5, not 5.000000
std::string text_of(Duration time);               // its seconds
inline constexpr const char* kClosed = "this simulation was closed";
inline constexpr const char* kForked =
    "this simulation is the parent process's: connect() again after a fork";

class Core : public std::enable_shared_from_this<Core> {
 public:
  // server: a private one, or nullptr. transport: nullptr opens the URL's, which throws NoServer.
  Core(const std::string& url, const std::string& name, std::unique_ptr<ServerProcess> server,
       std::unique_ptr<Transport> transport = nullptr);
  ~Core();

  void join(Duration timeout);  // begins to receive, and waits for ruedo/info; throws NoServer
  void close();                 // in a callback, too: the end follows by itself there
  bool is_called_back() const;  // this thread is in a callback
  bool closed() const { return closed_; }
  // At the beginning of a call, and while it waits. Throws NoServer, and what a callback threw.
  void check_open() const;
  void check_callbacks() const;  // throws what one of them threw
  // Before waiting for what the server sends. Throws NoServer; Error in a callback: the server may
  // wait for that.
  void check_may_wait() const;
  bool forked() const { return static_cast<bool>(forked_); }

  Bus& bus() { return bus_; }
  CallbackQueue& callbacks() { return callbacks_; }
  CallbackFaults& faults() { return *faults_; }
  Progress& progress() { return progress_; }
  SimClock& clock() { return clock_; }
  Session& session() { return session_; }
  Stepper& stepper() { return stepper_; }
  const std::string& url() const { return url_; }
  std::shared_ptr<const WorldInfo> info() const;
  bool in_lockstep() const;  // the clients say how far the run goes
  // Whether a message is of this client's run, or, where it may take over, of the one that has
  // taken its place. The receiving thread's.
  bool is_of_our_run(int64_t run_id, bool may_take_over = false);
  // Messages may be of the next run, whose info is still missing. For the receiving thread.
  bool in_doubt() const { return watch_.in_doubt(); }
  RobotInfo robot_info(const std::string& name) const;  // throws UnknownName
  // Requested once, and again when the world has changed.
  JointLimits joint_limits(const std::string& robot);
  int64_t utime() const { return clock_.utime(); }
  int64_t next_id() { return ++ids_; }

  // The stream of a channel, made on first use. raw: of its messages as they come.
  std::shared_ptr<StreamCore> stream(const ChannelInfo& channel, bool raw = false);
  std::shared_ptr<Driver> driver(const std::string& robot);

  void keep_repeating(const std::shared_ptr<Driver>& driver);
  // This thread works with what is known now. A callback is waited for anyway.
  void note_use();
  // A motion ended then, and this thread knows: next() of any stream gives nothing older.
  void begin_after(int64_t utime);
  int64_t not_before() const;    // us of sim time, which may have been reset since
  void sleep(int64_t duration);  // us
  // After the set of models changed; before: the info from before that, null: the one that is known
  // now.
  void refresh_info(std::shared_ptr<const WorldInfo> before = nullptr);
  bool server_has_ended();  // for certain; one that is looked for in vain just now has, too
  // Throws RunEnded when the run has, and NoServer when the server is gone or this was closed.
  void check_server();
  void note_end(const std::string& text);   // the server's last word
  Standstill standstill(std::string call);  // for a call that waits for sim time
  Subscription on_new_run(std::function<void()> callback);
  std::string what_is_known(double rate) const;  // for timeouts

 private:
  // In a thread of its own. False: there are too many threads.
  static bool ends_apart(const std::shared_ptr<Core>& self);
  std::string why_it_stands(const std::function<std::string()>& in_lockstep) const;
  void end();  // all but a callback that has not returned
  void await_callback();
  std::chrono::milliseconds before_turn();
  void on_info(const uint8_t* bytes, size_t size);
  void on_tick(const uint8_t* bytes, size_t size);
  void note_progress(int32_t epoch, int64_t utime);
  void forget_removed(const WorldInfo& info);
  void begin_run();
  void tell_another_server(int64_t run_id) const;
  void end_drivers(const std::vector<std::shared_ptr<Driver>>& drivers, MotionReason reason);
  void ask_info();
  bool is_there();  // a server on this machine, as of about a second ago
  void repeat();

  const Forked forked_;
  const std::string url_;
  std::unique_ptr<ServerProcess> server_;
  Clock::time_point listen_at_;  // to the server's warnings; the receiving thread's
  Progress progress_;
  std::unique_ptr<ToRegression> regression_;  // null: none launched this program
  SimClock clock_;
  mutable std::mutex mutex_;
  std::condition_variable news_;
  WorldInfoAssembler assembler_;  // the receiving thread's
  std::shared_ptr<const WorldInfo> known_;
  std::exception_ptr fault_;    // of an info that cannot be read
  Clock::time_point fault_at_;  // the first
  RunWatch watch_;
  std::string over_;  // the server's last word on the run
  std::atomic<bool> is_over_{false};
  std::map<std::pair<std::string, bool>, std::shared_ptr<StreamCore>> streams_;  // channel, raw
  std::map<std::string, std::shared_ptr<Driver>> drivers_;
  std::map<std::string, JointLimits> joint_limits_;  // by robot
  std::shared_ptr<const WorldInfo> joint_limits_of_;
  std::set<std::shared_ptr<Driver>> repeating_;
  std::map<std::thread::id, int64_t> ends_;  // of the motions that threads awaited, the last
  std::atomic<int64_t> ids_{0};
  std::atomic<Clock::time_point::rep> asked_{0};  // for info
  std::mutex looking_;
  Clock::time_point look_at_;  // for the server, again
  bool there_ = false;         // as it was then
  std::atomic<bool> closed_{false};
  std::promise<void> end_;  // of all that close() ends
  const std::shared_future<void> ended_ = end_.get_future().share();
  const std::shared_ptr<CallbackFaults> faults_ = std::make_shared<CallbackFaults>();
  const std::shared_ptr<CallbackList<>> new_run_ = std::make_shared<CallbackList<>>(faults_);
  std::thread repeater_;
  std::condition_variable wake_;
  Session session_;
  Stepper stepper_;
  CallbackQueue callbacks_;
  Bus bus_;
  Subscription info_source_, tick_source_, reply_source_;
};

}  // namespace ruedo::client
