// A recorded run, as the console sees it: to each viewer, at a moment of its own, the newest
// message of every channel that it watches.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "console/comparison.h"
#include "console/source.h"
#include "log/index.h"
#include "run/log_worlds.h"

namespace ruedo::console {

class LogSource : public Source {
 public:
  static constexpr size_t kMostHistory = 100'000;  // messages of a channel that are read for a plot
  static constexpr size_t kScanned = 2'000;        // messages at a time, for what happened
  static constexpr uint32_t kMostMessage = 64u << 20;  // bytes; a larger one is not shown

  // Throws InputError for what is no log. speed: log time per real time.
  // other: a log that is compared with it; "" for none. It is loaded by load_other.
  LogSource(const std::string& path, const run::LoadRun& load, double speed,
            const std::string& other = "", const run::LoadRun& load_other = {});

  void pump(Board& board, bool viewers) override;
  bool command(const std::string&, std::span<const uint8_t>) override { return false; }
  std::shared_ptr<const model::WorldModel> world(size_t scene) override;
  std::string fault() const override;
  std::string info_channel() const override { return info_channel_; }
  Bytes history(const std::string& channel, const std::string& field) override;
  const Events* events() const override { return scanned_ ? &scan_.events() : nullptr; }
  std::string compared() const override { return comparison_ ? comparison_->name() : ""; }
  std::string comparison() const override { return comparison_ ? comparison_->report() : ""; }
  std::unique_ptr<Look> look() override;

 private:
  friend class LogLook;

  // Behind those of the log, and the info that it may not have.
  size_t drawn_channel() const { return index_.channels().size() + (makes_info_ ? 1 : 0); }
  size_t compared_channel() const { return drawn_channel() + 1; }

  const std::string path_;
  const double speed_;
  log::Index index_;
  run::LogWorlds worlds_;
  EventScan scan_;
  bool scanned_ = false;
  log::Reader reader_;
  std::string info_channel_;
  bool makes_info_ = false;  // the log has none: it is the channel after all of the log's
  std::unique_ptr<Comparison> comparison_;  // null: with none
};

// What a viewer sees of a log. Time begins with it, and stands still where it is paused.
class LogLook : public Look {
 public:
  // The source must outlive it.
  explicit LogLook(LogSource& source);

  void pump(Board& board) override;
  Count traffic(size_t channel) const override;
  size_t scene() const override { return source_.worlds_.number(now_us()); }
  const Playback& playback() const override { return playback_; }
  void play(bool on, double speed) override;
  void seek(Board& board, double time_s) override;
  void step(Board& board, int states) override;

 private:
  static constexpr size_t kNothing = static_cast<size_t>(-1);

  SimTime now_us() const;
  void show(Board& board);
  void show_drawn(Board& board);
  void load(Board& board, size_t channel, size_t count);

  LogSource& source_;
  log::Reader reader_;
  log::Event event_;
  const run::LogWorlds::Scene* told_ = nullptr;  // whose info is on the board
  // Of each channel, how many messages there were when one was put on the board.
  std::vector<size_t> shown_;
  std::vector<size_t> shown_layers_;          // of each layer, as shown_
  std::optional<Comparison::Ghosts> ghosts_;  // none: nothing is compared
  Playback playback_;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace ruedo::console
