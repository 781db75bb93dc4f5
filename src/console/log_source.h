// A recorded run, as the console sees it: gives each viewer the newest message of every channel
// that it watches, at the viewer's own moment.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "console/comparison.h"
#include "console/source.h"
#include "log/index.h"
#include "run/repeat/log_worlds.h"

namespace ruedo::console {

class LogSource : public Source {
 public:
  static constexpr size_t kMostHistory = 100'000;      // messages of a channel read for a plot
  static constexpr size_t kMostFields = 16;            // of a channel in one plot
  static constexpr size_t kScanned = 2'000;            // messages scanned for events at a time
  static constexpr uint32_t kMostMessage = 64u << 20;  // bytes; larger ones are not shown
  // Bytes that are read for a plot, and for all viewers at a time: the request of one viewer delays
  // the others no longer.
  static constexpr size_t kMostForPlot = 256u << 20, kMostAtATime = 64u << 20;
  // Bytes of the messages that all viewers' boards hold; what has no room is not shown.
  static constexpr size_t kMostHeld = 256u << 20;

  // Throws InputError for a file that is not a log. speed: log time per wall time. other: a log to
  // compare with, loaded by load_other; "" for none.
  LogSource(const std::string& path, const run::LoadRun& load, double speed,
            const std::string& other = "", const run::LoadRun& load_other = {});

  void pump(Board& board, bool viewers) override;
  bool command(const std::string&, std::span<const uint8_t>) override { return false; }
  std::shared_ptr<const world::WorldModel> world(size_t scene) override;
  std::string fault() const override;
  std::string info_channel() const override { return info_channel_; }
  http::Bytes history(const std::string& channel, const std::string& fields) override;
  const Events* events() const override { return scanned_ ? &scan_.events() : nullptr; }
  std::string compared() const override { return comparison_ ? comparison_->name() : ""; }
  std::string comparison() const override { return comparison_ ? comparison_->report() : ""; }
  std::unique_ptr<Look> look() override;

 private:
  friend class LogLook;

  // After those of the log, and the info channel if the log has none.
  size_t drawn_channel() const { return index_.channels().size() + (makes_info_ ? 1 : 0); }
  size_t compared_channel() const { return drawn_channel() + 1; }

  const std::string path_;
  const double speed_;
  log::Index index_;
  run::LogWorlds worlds_;
  EventScan scan_;
  bool scanned_ = false;
  size_t looks_ = 0;
  size_t held_ = 0;  // bytes, by all boards
  log::Reader reader_;
  std::string info_channel_;
  bool makes_info_ = false;  // the log has none: its channel follows those of the log
  std::unique_ptr<Comparison> comparison_;  // null: no comparison
};

// One viewer's view of a log. Its time starts with it, and stops while paused.
class LogLook : public Look {
 public:
  // The source must outlive it.
  explicit LogLook(LogSource& source);
  ~LogLook() override;
  LogLook(const LogLook&) = delete;
  LogLook& operator=(const LogLook&) = delete;

  void pump(Board& board) override;
  Count traffic(size_t channel) const override;
  size_t scene() const override { return source_.worlds_.number(now_us()); }
  const Playback& playback() const override { return playback_; }
  void play(bool on, double speed) override;
  void seek(double time_s) override;
  void step(int states) override;

 private:
  static constexpr size_t kNothing = static_cast<size_t>(-1);

  SimTime now_us() const;
  void show(Board& board);
  void show_drawn(Board& board);
  size_t load(Board& board, size_t channel, size_t count);  // bytes
  void forget(Board& board, size_t channel);

  LogSource& source_;
  log::Reader reader_;
  log::Event event_;
  const run::LogWorlds::Scene* told_ = nullptr;  // whose info is on the board
  // For each channel, the number of messages up to the one put on the board.
  std::vector<size_t> shown_;
  std::vector<size_t> held_;                  // for each channel, bytes on the board
  size_t next_ = 0;                           // the channel to begin with
  std::vector<size_t> shown_layers_;          // for each layer, like shown_
  std::optional<Comparison::Ghosts> ghosts_;  // none: no comparison
  Playback playback_;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace ruedo::console
