// The newest messages of each channel, for the console's viewers. Used by the console thread only.
//
// For most channels one message is kept. Messages in parts are kept together, also the last few
// replies, so that no client misses its own, and the newest markers of each layer.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "http/bytes.h"

namespace ruedo::console {

class Board {
 public:
  static constexpr size_t kKeptReplies = 64;
  static constexpr size_t kMostParts = 256;

  struct Message {
    uint64_t number;  // counts all messages that reached this board
    http::Bytes bytes;
  };
  struct Channel {
    std::string name;
    std::vector<Message> newest;
    uint64_t last_number = 0;  // of the newest message; 0: none yet
    int64_t fingerprint = 0;
    std::optional<size_t> part_at;  // offset of the number of the part
    bool replies = false, layers = false;
    int watchers = 0;  // viewers that subscribed
  };

  // Adds channels up to that one. Names that are not UTF-8 are shown with '?'.
  void name(size_t channel, const std::string& name);
  void put(size_t channel, std::vector<uint8_t> message);

  // Whether it continues the previous message: a part, but not the first.
  static bool is_later_part(std::span<const uint8_t> message);

  std::vector<Channel>& channels() { return channels_; }
  const std::vector<Channel>& channels() const { return channels_; }
  uint64_t newest() const { return number_; }

 private:
  std::vector<Channel> channels_;
  uint64_t number_ = 0;
};

}  // namespace ruedo::console
