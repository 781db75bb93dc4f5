// One browser: its subscriptions, its progress of receiving, and its requests.
//
// A viewer gets new messages only after it has received the previous ones, so a slow viewer gets
// fewer of them.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "console/board.h"
#include "console/source.h"
#include "http/web_server.h"

namespace ruedo::console {

class Viewer;

// The shared state of all viewers.
struct Stage {
  Board board;  // for a running server
  std::unique_ptr<Source> source;
  std::string greeting;        // JSON, the first message to a viewer
  std::string farewell;        // JSON, the last message; "" while the run continues
  uint64_t world_version = 0;  // for a running server; changes when the scene does
  std::vector<Viewer*> viewers;
  bool is_log = false;
};

// Messages from a browser: an operation, then its data.
enum class Operation : uint8_t {
  seen = 1,     // the oldest outstanding frame has been received
  want = 2,     // names of channels, one per line: replaces the previous ones
  command = 3,  // length of the name (1 byte), name, message: sent on that channel
  traffic = 4,  // 1 or 0: send the traffic of each channel once a second
  play = 5,     // for a log: 1 or 0 (1 byte), speed (float64, little endian)
  seek = 6,     // for a log: time in s (float64, little endian)
  step = 7,     // for a log: 1 or 0 (1 byte): to the next or the previous state
};
// Binary messages to the browser; text messages are JSON.
enum class Frame : uint8_t { messages = 1, traffic = 2 };

class Viewer : public http::Connection {
 public:
  static constexpr int kMostUnseen = 2;                  // frames
  static constexpr size_t kMostFrame = size_t{8} << 20;  // bytes; may be exceeded by one message
  static constexpr size_t kMostWanted = 4096;            // channels
  static constexpr size_t kMostEvents = 1000;            // in one message

  explicit Viewer(Stage& stage);
  ~Viewer() override;

  bool on_message(std::span<const uint8_t> message) override;
  bool next(std::vector<uint8_t>& message, bool& text) override;

  // For a log: advances its view.
  void pump();

 private:
  void want(std::string_view names);
  void match_names();
  bool next_text(std::string& text);
  bool next_messages(std::vector<uint8_t>& frame);
  bool next_playback(std::string& text);
  bool next_events(std::string& text);
  bool next_warnings(std::string& text);
  void add_traffic(std::vector<uint8_t>& frame);
  Board& board() { return look_ ? own_board_ : stage_.board; }

  Stage& stage_;
  std::unique_ptr<Look> look_;  // null: a running server
  Board own_board_;             // for the view of a log
  std::vector<std::string> wanted_names_;
  struct Sight {
    bool wanted = false;
    uint64_t sent = 0;  // number of the newest message sent
  };
  std::vector<Sight> sights_;  // for each of the board's channels
  size_t told_channels_ = 0;   // number of channels whose names the browser has
  uint64_t told_world_ = 0;    // version, or scene of a log
  std::optional<Playback> told_playback_;
  std::chrono::steady_clock::time_point told_playback_at_;
  size_t told_events_ = 0;                 // in the list
  uint64_t told_generation_ = UINT64_MAX;  // generation of that list
  size_t told_warnings_ = 0;               // of the program
  bool compared_ = false;                  // the differences have been sent
  bool greeted_ = false, parted_ = false, traffic_ = false;
  std::string note_;  // to be sent next
  int unseen_ = 0;
  std::chrono::steady_clock::time_point next_traffic_;
};

}  // namespace ruedo::console
