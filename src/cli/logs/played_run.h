// Answers clients' requests for a run that is played from its log: connect() works on it.
//
// The log has no ruedo/info: it is made from the header, as the run's world changed. It lists no
// request and no command, so that clients refuse to change the run.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "bus/lcm_bus.h"
#include "run/repeat/log_worlds.h"

namespace ruedo::cli {

class PlayedRun {
 public:
  // Listens on the bus. A world that cannot be read is reported, and info has only the channels.
  PlayedRun(const std::string& path, bus::LcmBus& bus);
  PlayedRun(const PlayedRun&) = delete;
  PlayedRun& operator=(const PlayedRun&) = delete;
  ~PlayedRun();

  // Publishes ruedo/info where it is due: once a second of real time, when the world has changed,
  // and when a client has asked.
  void serve(SimTime time_us);
  bool serves() const { return worlds_ != nullptr; }  // else it is played without ruedo/info
  bool asked() const { return asked_; }               // by a client, since the last info
  void end();                                         // notifies clients of the log's end

 private:
  void make_worlds(const std::string& path);
  void publish(const std::vector<std::vector<uint8_t>>& parts, SimTime time_us);

  bus::LcmBus& bus_;
  std::unique_ptr<run::LogWorlds> worlds_;  // null: of no run, or a log that can be read once only
  const int64_t run_id_;
  std::atomic<bool> asked_{false};
  size_t scene_ = 0;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace ruedo::cli
