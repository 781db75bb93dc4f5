// LCM's tcpq on the wire, the server's side: parses the client's stream, and keeps a client's
// subscriptions.
//
// A client sends its magic and the version, hears the server's, and then sends frames: PUBLISH
// (channel, data), SUBSCRIBE and UNSUBSCRIBE (a regular expression). The server sends PUBLISH
// frames alone. Numbers are big endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace ruedo::bus::tcpq {

inline constexpr uint32_t kServerMagic = 0x287617fa, kClientMagic = 0x287617fb, kVersion = 0x0100;
inline constexpr size_t kLongestChannel = 63;  // LCM's
inline constexpr size_t kLongestPattern = 64 * 1024;
inline constexpr size_t kLargestMessage = 4 * 1024 * 1024;  // from a client

// The greeting of each side.
std::vector<uint8_t> server_hello();
std::vector<uint8_t> client_hello();
// Append a PUBLISH, or a SUBSCRIBE or UNSUBSCRIBE with a channel's name.
void append_subscribe(std::vector<uint8_t>& out, std::string_view name);
void append_unsubscribe(std::vector<uint8_t>& out, std::string_view name);
void append_publish(std::vector<uint8_t>& out, std::string_view channel,
                    std::span<const uint8_t> data);
// Of a whole PUBLISH that begins there.
size_t size_of_publish(const uint8_t* frame);

struct Frame {
  enum class Kind { publish, subscribe, unsubscribe };
  Kind kind;
  std::string_view channel;       // or the pattern
  std::span<const uint8_t> data;  // of a publish
};

// Splits one client's stream into frames. Holds the bytes of the incomplete frame, never more than
// were received.
class Reader {
 public:
  void add(std::span<const uint8_t> bytes) {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  }

  enum class Result { frame, more, broken };
  // The next frame, valid until add() or tidy(); `more` if it is incomplete; `broken` if this is
  // not a tcpq client or a length is not allowed.
  Result next(Frame& frame);
  // Forgets what was read.
  void tidy();

  bool greeted() const { return greeted_; }
  size_t held() const { return buffer_.size(); }

 private:
  uint32_t number(size_t at) const;

  std::vector<uint8_t> buffer_;
  size_t read_ = 0;
  bool greeted_ = false;
};

// The channels that one client subscribed to, or more: a pattern that is neither a name nor a
// name's beginning passes everything that begins as it does, for LCM filters again in the client.
// So no client's expression is ever run here.
class Filter {
 public:
  static constexpr size_t kMostNames = 65536, kMostBeginnings = 64;

  void subscribe(std::string_view pattern);
  void unsubscribe(std::string_view pattern);
  bool passes(std::string_view channel) const;
  bool empty() const { return names_.empty() && beginnings_.empty(); }

 private:
  std::unordered_map<std::string, int> names_, beginnings_;  // with the number of requests
};

// A pattern as a name, or as the beginning that all names which match it have.
struct Pattern {
  std::string text;
  bool whole;
};
Pattern read_pattern(std::string_view pattern);

}  // namespace ruedo::bus::tcpq
