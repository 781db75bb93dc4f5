// The source of a console: a running server, or a recorded log. Used by the console's thread only.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "console/board.h"
#include "console/events.h"
#include "world/model/world_model.h"

namespace ruedo::console {

// The state of a log's player.
struct Playback {
  double begin_s = 0, end_s = 0, now_s = 0;  // log time
  double speed = 1;                          // log time per wall time
  bool playing = false;
  int64_t jumps = 0;  // counts discontinuities: what was drawn along the path is then invalid
  friend bool operator==(const Playback&, const Playback&) = default;
};

// The traffic on a channel.
struct Count {
  uint64_t messages = 0;
  uint32_t size = 0;  // size of the newest message, bytes
};

// One viewer's view of a log: each viewer has a playhead of its own.
class Look {
 public:
  virtual ~Look() = default;

  // Updates what is to be seen now.
  virtual void pump(Board& board) = 0;
  virtual Count traffic(size_t channel) const = 0;
  // The log's scene to show, from 0.
  virtual size_t scene() const = 0;
  virtual const Playback& playback() const = 0;
  virtual void play(bool on, double speed) = 0;
  virtual void seek(double time_s) = 0;
  // Moves by that many states, forward or back.
  virtual void step(int states) = 0;
};

class Source {
 public:
  virtual ~Source() = default;

  // Brings news to the board. viewers: whether anybody watches.
  virtual void pump(Board& board, bool viewers) = 0;
  // Another viewer has come, or a viewer subscribes to another channel, which the board knows: from
  // now on no message on it may be missed, including the reply to the viewer's next request.
  virtual void attend(const Board& board) { static_cast<void>(board); }

  // For the board's channel.
  virtual Count traffic(size_t channel) const {
    static_cast<void>(channel);
    return {};
  }

  // Passes on a viewer's message to the simulation; false if none is accepted.
  virtual bool command(const std::string& channel, std::span<const uint8_t> message) = 0;

  // The world to show; the pointer changes when the world does; null without one. scene: which
  // scene of a log.
  virtual std::shared_ptr<const world::WorldModel> world(size_t scene) = 0;
  // "" or the reason why it has no world.
  virtual std::string fault() const { return {}; }
  // The channel of world_info_t.
  virtual std::string info_channel() const = 0;

  // SDF or URDF of a model of the world, as SPAWN takes it; "" if not available.
  virtual std::string model_text(const std::string& name) {
    static_cast<void>(name);
    return {};
  }
  // log_header_t of a running server, for logs that a page records; null without one.
  virtual http::Bytes log_header() { return nullptr; }
  // The file written by SAVE; "" for none.
  virtual std::string save_name() const { return {}; }

  // Fields over the whole log, as float64, little endian: how many messages were read per row, then
  // for each row its time in s and the values, NaN for missing ones; null for an unknown channel.
  // fields: "vel[0]", or "min(ranges)", also max, mean and sum; several with commas between them.
  virtual http::Bytes history(const std::string& channel, const std::string& fields) {
    static_cast<void>(channel), static_cast<void>(fields);
    return nullptr;
  }

  // The events; null: not known yet.
  virtual const Events* events() const { return nullptr; }

  // For a log compared with another one: the other's name, and the differences as JSON; "" for
  // none, or until known.
  virtual std::string compared() const { return {}; }
  virtual std::string comparison() const { return {}; }

  // For a viewer of a log; null: all viewers see the console's board.
  virtual std::unique_ptr<Look> look() { return nullptr; }
};

}  // namespace ruedo::console
