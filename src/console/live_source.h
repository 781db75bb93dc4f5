// A running server, as the console sees it: the messages in its run, and its world.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "console/source.h"
#include "console/tap.h"

namespace ruedo::console {

// Requests to the run; from any thread.
struct LiveHost {
  std::function<std::shared_ptr<const world::WorldModel>()> world;
  std::function<std::string(const std::string& name)> model_text;
  std::function<void(const std::string& channel, std::span<const uint8_t> message)> on_message;
  std::function<uint64_t()> lost;                    // messages that the bus could not send
  std::function<std::vector<uint8_t>()> log_header;  // null: none
  std::string save_name;                             // of the file written by SAVE
};

class LiveSource : public Source {
 public:
  // The tap must outlive it.
  LiveSource(Tap& tap, LiveHost host, std::string info_channel)
      : tap_(tap), host_(std::move(host)), info_channel_(std::move(info_channel)) {
    events_.plan(host_.world()->faults);
  }
  ~LiveSource() override { tap_.watch(false); }

  void pump(Board& board, bool viewers) override {
    tap_.watch(viewers);
    std::vector<Tap::Drawing> drawn = tap_.take_drawn();  // before its channels are counted
    const size_t count = tap_.channel_count();
    for (size_t i = board.channels().size(); i < count; ++i) board.name(i, tap_.channel(i).name);
    tap_.ring().drain([&](uint32_t channel, std::vector<uint8_t> message) {
      if (channel >= board.channels().size()) return;
      events_.hear(0, board.channels()[channel].name, message);
      board.put(channel, std::move(message));
    });
    if (viewers) {
      // Called after the offered messages, which are all older.
      Tap::State state = tap_.take_state(count);
      for (std::vector<uint8_t>& part : state.parts) board.put(state.channel, std::move(part));
    }
    for (Tap::Drawing& drawing : drawn) board.put(drawing.channel, std::move(drawing.message));
    events_.lost(host_.lost());
    choose(board);
  }
  void attend(const Board& board) override {
    tap_.watch(true);
    choose(board);
  }

  Count traffic(size_t channel) const override {
    const Traffic& traffic = tap_.channel(channel);
    return {traffic.messages.load(std::memory_order_relaxed),
            traffic.size.load(std::memory_order_relaxed)};
  }
  bool command(const std::string& channel, std::span<const uint8_t> message) override {
    if (!tap_.takes(channel)) return false;
    host_.on_message(channel, message);
    return true;
  }
  std::shared_ptr<const world::WorldModel> world(size_t scene) override {
    return scene == 0 ? host_.world() : nullptr;
  }
  std::string model_text(const std::string& name) override { return host_.model_text(name); }
  http::Bytes log_header() override {
    if (!host_.log_header) return nullptr;
    return std::make_shared<const std::vector<uint8_t>>(host_.log_header());
  }
  std::string save_name() const override { return host_.save_name; }
  std::string info_channel() const override { return info_channel_; }
  const Events* events() const override { return &events_; }

 private:
  void choose(const Board& board) {
    for (size_t i = 0; i < board.channels().size(); ++i) {
      const Board::Channel& channel = board.channels()[i];
      // A channel's type is known from its first message.
      const bool heard = channel.last_number == 0 || Events::tells(channel.fingerprint);
      tap_.channel(i).wanted.store(heard || channel.watchers > 0, std::memory_order_relaxed);
    }
  }

  Tap& tap_;
  LiveHost host_;
  Events events_{true};
  std::string info_channel_;
};

}  // namespace ruedo::console
