// What a console shows: a running server, or a recorded log. The console's thread alone calls it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "console/board.h"
#include "console/events.h"
#include "model/world_model.h"

namespace ruedo::console {

// Where the player of a log is.
struct Playback {
  double begin_s = 0, end_s = 0, now_s = 0;  // log time
  double speed = 1;                          // log time per real time
  bool playing = false;
  int64_t jumps = 0;  // counts what is no playing on: what was drawn along the way does not hold
  friend bool operator==(const Playback&, const Playback&) = default;
};

// What has gone over a channel.
struct Count {
  uint64_t messages = 0;
  uint32_t size = 0;  // bytes of the newest message
};

// What one viewer of a log sees of it: each has a playhead of its own.
class Look {
 public:
  virtual ~Look() = default;

  // Goes on to what is to be seen now.
  virtual void pump(Board& board) = 0;
  virtual Count traffic(size_t channel) const = 0;
  // Of the log's scenes the one to show, from 0.
  virtual size_t scene() const = 0;
  virtual const Playback& playback() const = 0;
  virtual void play(bool on, double speed) = 0;
  virtual void seek(Board& board, double time_s) = 0;
  // So many states on, or back.
  virtual void step(Board& board, int states) = 0;
};

class Source {
 public:
  virtual ~Source() = default;

  // Brings what is new to the board. viewers: whether anybody watches.
  virtual void pump(Board& board, bool viewers) = 0;
  // Another viewer, or another channel that one wants, which the board knows: from now on nothing
  // of it is missed, a reply to the viewer's very next request neither.
  virtual void attend(const Board& board) { static_cast<void>(board); }

  // Over the board's channel.
  virtual Count traffic(size_t channel) const {
    static_cast<void>(channel);
    return {};
  }

  // A viewer's message to the simulation; false where none is taken.
  virtual bool command(const std::string& channel, std::span<const uint8_t> message) = 0;

  // The world to show, another pointer when it has changed; null when there is none. scene: of a
  // log, of its scenes.
  virtual std::shared_ptr<const model::WorldModel> world(size_t scene) = 0;
  // "" or why there is no world.
  virtual std::string fault() const { return {}; }
  // The channel of world_info_t.
  virtual std::string info_channel() const = 0;

  // SDF or URDF of a model of the world, as SPAWN takes it; "" where it is not told.
  virtual std::string model_text(const std::string& name) {
    static_cast<void>(name);
    return {};
  }
  // Of the file that SAVE writes; "" for none.
  virtual std::string save_name() const { return {}; }

  // A field ("vel[0]") over the whole of a log, as float64s, little endian: every how many messages
  // were read, then time in s and value of each; null where there is no such channel.
  virtual Bytes history(const std::string& channel, const std::string& field) {
    static_cast<void>(channel), static_cast<void>(field);
    return nullptr;
  }

  // What happened; null: not known yet.
  virtual const Events* events() const { return nullptr; }

  // Of a log beside which another one is shown: its name, and what differs as JSON; "" for none,
  // and while it is not known.
  virtual std::string compared() const { return {}; }
  virtual std::string comparison() const { return {}; }

  // For a viewer of a log; null: all see the same, what is on the console's board.
  virtual std::unique_ptr<Look> look() { return nullptr; }
};

}  // namespace ruedo::console
