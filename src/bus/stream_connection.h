// A client's end of a stream of tcpq's frames, over TCP or a Unix-domain socket: sends, and parses
// what was received (see tcpq_wire.h).
//
// Safe to publish and subscribe from any thread; receive() from one at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <string_view>
#include <vector>

#include "system/file_handle.h"

namespace ruedo::bus {

class StreamConnection {
 public:
  using Handler = std::function<void(std::string_view channel, const uint8_t* data, size_t size)>;

  // socket: connected, made by stream_socket().
  explicit StreamConnection(FileHandle socket);

  // False when the server is gone or takes nothing: the connection is over.
  bool publish(std::string_view channel, const uint8_t* data, size_t size);
  bool subscribe(std::string_view name);  // a channel's, no pattern
  bool unsubscribe(std::string_view name);

  // Waits at most so long (ms) for something, and calls the handler for each whole message that
  // came. False when there was nothing.
  bool receive(int timeout_ms, const Handler& handler);
  bool is_over() const { return over_; }
  int file() const { return socket_.get(); }

 private:
  bool send(const std::vector<uint8_t>& bytes);
  bool end();  // false

  FileHandle socket_;
  std::mutex sending_;
  std::vector<uint8_t> frame_;
  std::vector<uint8_t> buffer_;  // received; [begin_, end_) is not taken yet
  size_t begin_ = 0, end_ = 0;
  bool greeted_ = false, over_ = false;
};

}  // namespace ruedo::bus
