// What happened in a run, as moments to jump to: collisions, commands, requests, resets, the
// watchdog, goals, faults, messages that were lost.
//
// It is told from messages as they follow each other; what lasts, or is repeated, is one event.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "console/drawn.h"
#include "core/json.h"
#include "log/index.h"
#include "model/world_model.h"
#include "ruedo/motion_status_t.hpp"
#include "ruedo/request_t.hpp"

namespace ruedo::console {

struct Event {
  double time_s = 0;  // the time line's
  std::string kind;   // "collision", "blocked", "command", "request", "reset", "watchdog", "goal",
                      // "refused", "fault", "lost"
  std::string robot;  // "" for the whole run
  std::string text;
};

class Events {
 public:
  static constexpr size_t kMost = 20'000;  // later ones are not kept

  // live: the time is that of the messages themselves, and a reset empties the list.
  explicit Events(bool live) : live_(live) {}

  // Whether messages of that type may tell of something.
  static bool tells(int64_t fingerprint);

  // The faults that the run will have of itself.
  void plan(const std::vector<model::Fault>& faults);
  // A message, in the order in which they came. What is no whole message is no event.
  void hear(double time_s, const std::string& channel, std::span<const uint8_t> message);
  // So many messages could not be sent so far.
  void lost(uint64_t count);

  // In the order in which they were heard.
  const std::vector<Event>& list() const { return list_; }
  // Another one when the list was reset.
  uint64_t generation() const { return generation_; }

 private:
  using Touched = std::map<std::string, double>;  // bodies, and when each was touched last

  void add(const std::string& kind, const std::string& robot, const std::string& text);
  void touches(const std::string& channel, std::span<const uint8_t> message);
  void motion(const std::string& channel, const motion_status_t& now);
  void command(const std::string& channel, std::span<const uint8_t> message);
  void done(int32_t kind, std::span<const uint8_t> body);
  void replied(std::span<const uint8_t> message);
  void reset();
  void come_due();

  bool live_;
  std::vector<Event> list_;
  uint64_t generation_ = 0;
  double now_s_ = 0;
  std::map<std::string, Touched> touched_;                  // by robot
  std::set<std::string> heard_;                             // channels of touches
  std::map<std::string, motion_status_t> motions_;          // by channel, the newest
  std::map<std::string, std::string> blocked_by_;           // by robot, of those that tell
  std::map<std::string, double> commanded_;                 // by channel, when last
  std::map<std::pair<int64_t, int64_t>, request_t> asked_;  // by session and sequence; not answered
  std::vector<model::Fault> planned_;                       // by time
  size_t due_ = 0;                                          // of them, those that have come
  uint64_t lost_ = 0;
};

// The events of a log, and what clients drew in it, read piece by piece.
class EventScan {
 public:
  // world: of the log's beginning; null: not known.
  EventScan(const log::Index& index, const model::WorldModel* world);

  // Reads up to so many messages; true when all have been read.
  bool advance(log::Reader& reader, size_t messages);
  const Events& events() const { return events_; }
  const Drawn& drawn() const { return drawn_; }

 private:
  struct Place {
    SimTime time_us;
    int64_t offset;
  };
  std::vector<Place> places_;  // of what may tell, by time
  size_t next_ = 0;
  Events events_{false};
  Drawn drawn_;
  log::Event event_;
};

// [{"t": 1.5, "kind": "collision", "robot": "p3at", "text": "..."}, ...] from the first on.
void write_events(JsonWriter& json, std::span<const Event> events);

}  // namespace ruedo::console
