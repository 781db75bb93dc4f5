// Compares the run shown with another one: where its bodies are at each moment, how far apart the
// robots are, and the first difference.
//
// The comparison runs in a thread of its own, as a long log takes a while; everything else belongs
// to the console's thread.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "console/board.h"
#include "log/index.h"
#include "run/repeat/log_worlds.h"

namespace ruedo::console {

class Comparison {
 public:
  // Channels added to those of the log shown.
  static constexpr const char* kStates = "compared/ruedo/world";  // the other run's world_state_t
  // followed by ROBOT: with fields "distance" and "angle"
  static constexpr const char* kApart = "compared/";

  // Throws InputError for a file that is not a log. index, worlds: of the log shown; they must
  // outlive it.
  Comparison(const std::string& log, const log::Index& index, const run::LogWorlds& worlds,
             const std::string& other, const run::LoadRun& load);
  ~Comparison();
  Comparison(const Comparison&) = delete;
  Comparison& operator=(const Comparison&) = delete;

  // The other run's file name.
  const std::string& name() const { return name_; }
  // "", or what of the other run cannot be shown.
  std::string fault() const;

  // The other run's bodies for one viewer. The comparison must outlive it.
  class Ghosts {
   public:
    explicit Ghosts(const Comparison& comparison)
        : comparison_(&comparison), reader_(comparison.path_) {}

    // Puts the other run's state at that moment on the board, if it has changed.
    void show(Board& board, size_t channel, SimTime time_us);
    void forget() { shown_ = kNothing; }  // the board has been cleared: put it there again

   private:
    static constexpr size_t kNothing = static_cast<size_t>(-1);

    const std::vector<int32_t>& matched(const run::LogWorlds::Scene& shown,
                                        const run::LogWorlds::Scene& other);

    const Comparison* comparison_;
    log::Reader reader_;
    size_t shown_ = kNothing;  // number of states up to the one put on the board
    const run::LogWorlds::Scene *matched_shown_ = nullptr, *matched_other_ = nullptr;
    std::vector<int32_t>
        matched_;  // for each body of the other run, its index in the log's; -1: none
  };

  // For a robot: time in s and distance in m, or angle in rad, between its poses in the log and in
  // the other run; null unless both have the robot.
  http::Bytes apart(const std::string& robot, const std::string& field);

  // {"comparison": ...}; "" until it is known.
  std::string report() const;

 private:
  struct Sample {
    double time_s, distance_m, angle_rad;
  };
  struct Robot {
    std::string name;
    size_t shown, other;  // channels of their pose_t
  };

  void find_robots();
  std::vector<Sample> samples(const Robot& robot, size_t most) const;
  void write_report();

  std::string log_, path_, name_;
  const log::Index& index_;
  const run::LogWorlds& worlds_;
  log::Index other_;
  run::LogWorlds other_worlds_;
  std::optional<size_t> states_;              // the other run's channel of world_state_t
  std::vector<Robot> robots_;                 // in both
  std::vector<std::string> missing_, extra_;  // robots that only one of them has

  std::atomic<bool> ending_{false};
  mutable std::mutex mutex_;
  std::string report_;  // guarded by the mutex
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace ruedo::console
