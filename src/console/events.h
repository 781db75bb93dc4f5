// The events of a run, as moments to jump to: collisions, commands, requests, resets, watchdog
// stops, goals, faults, lost messages.
//
// Derived from the sequence of messages; what lasts or is repeated counts as one event.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/json.h"
#include "console/drawn.h"
#include "log/index.h"
#include "ruedo/motion_status_t.hpp"
#include "ruedo/request_t.hpp"
#include "world/model/world_model.h"

namespace ruedo::console {

struct Event {
  double time_s = 0;  // on the time line
  std::string kind;   // "collision", "blocked", "command", "request", "reset", "watchdog", "goal",
                      // "refused", "fault", "lost"
  std::string robot;  // "" for the whole run
  std::string text;
};

class Events {
 public:
  static constexpr size_t kMost = 20'000;      // later ones are dropped
  static constexpr size_t kLongestText = 300;  // bytes; the rest is left out

  // live: times are those of the messages, and a reset clears the list.
  explicit Events(bool live) : live_(live) {}

  // Whether messages of that type can give events.
  static bool tells(int64_t fingerprint);

  // The faults that the run will have on its own.
  void plan(const std::vector<world::Fault>& faults);
  // Messages in order of arrival. An incomplete message gives no event.
  void hear(double time_s, const std::string& channel, std::span<const uint8_t> message);
  // The number of messages that could not be sent until now.
  void lost(uint64_t count);

  // In order of occurrence.
  const std::vector<Event>& list() const { return list_; }
  // Changes when the list is cleared.
  uint64_t generation() const { return generation_; }

 private:
  using Touched = std::map<std::string, double>;  // bodies with the time of their last contact

  void add(const std::string& kind, const std::string& robot, const std::string& text);
  void touches(const std::string& channel, std::span<const uint8_t> message);
  void motion(const std::string& channel, const motion_status_t& now);
  void command(const std::string& channel, std::span<const uint8_t> message);
  void done(int32_t kind, const std::string& name);
  void replied(std::span<const uint8_t> message);
  void reset();
  void come_due();

  bool live_;
  std::vector<Event> list_;
  uint64_t generation_ = 0;
  double now_s_ = 0;
  std::map<std::string, Touched> touched_;          // by robot
  std::set<std::string> heard_;                     // channels with contacts
  std::map<std::string, motion_status_t> motions_;  // by channel, the newest
  std::map<std::string, std::string> blocked_by_;   // by robot: the channel that reports its blocks
  std::map<std::string, double> commanded_;         // by channel: time of the last command
  struct Asked {
    int32_t kind = 0;
    std::string name;  // of what it is about
  };
  std::map<std::pair<int64_t, int64_t>, Asked> asked_;  // by session and sequence; unanswered
  std::vector<world::Fault> planned_;                   // sorted by time
  size_t due_ = 0;                                      // number of those that have started
  uint64_t lost_ = 0;
};

// The events of a log and what clients drew in it, read piece by piece.
class EventScan {
 public:
  // world: of the log's start; null: not known.
  EventScan(const log::Index& index, const world::WorldModel* world);

  // Reads up to that many messages; true once all have been read.
  bool advance(log::Reader& reader, size_t messages);
  const Events& events() const { return events_; }
  const Drawn& drawn() const { return drawn_; }

 private:
  // A channel whose messages may give events, and its next message.
  struct Source {
    log::Places::Cursor cursor;
    log::Place next;
  };
  static bool later(const Source& a, const Source& b) { return a.next.offset > b.next.offset; }

  std::vector<Source> sources_;  // a heap: the first has the next message of the log
  Events events_{false};
  Drawn drawn_;
  log::Event event_;
};

// [{"t": 1.5, "kind": "collision", "robot": "p3at", "text": "..."}, ...] from the first on.
void write_events(JsonWriter& json, std::span<const Event> events);

}  // namespace ruedo::console
