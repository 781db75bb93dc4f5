// A client's session with the server: requests are repeated until they are answered, and executed
// once.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "ends.h"
#include "replies.h"
#include "ruedo/client.h"

namespace ruedo {
struct request_t;
}

namespace ruedo::client {

class Core;

inline constexpr const char* kRequestChannel = "ruedo/request";

struct Reply {
  int32_t epoch = 0;
  int64_t session = 0, sequence = 0;
  int32_t kind = 0, code = 0;
  std::string text;
  std::vector<uint8_t> body;
};

// Throws TypeMismatch.
[[noreturn]] void wrong_body(const char* type, const std::exception& error);

class Session {
 public:
  // Throws std::invalid_argument for a name that no server takes.
  Session(Core& core, std::string name);

  // Joins on the first request. Throws NotSupported, RequestError, Timeout (after `timeout` of real
  // time).
  Reply request(int32_t kind, const std::vector<uint8_t>& body, Duration timeout);
  // For grants, which are not answered by replies: keeps other requests waiting while the lock
  // lives.
  std::unique_lock<std::mutex> turn() { return std::unique_lock(one_at_a_time_); }
  Reply request_in_turn(int32_t kind, const std::vector<uint8_t>& body, Duration timeout);
  // Throws Error for a request that no server would take.
  static void check_size(const std::vector<uint8_t>& body);
  int64_t next_sequence() { return ++sequence_; }
  int64_t id() const { return session_; }
  const std::string& name() const { return name_; }
  // Nothing any more, once this leaves: its answer would be an error.
  void publish(int32_t kind, int64_t session, int64_t sequence, const std::vector<uint8_t>& body,
               int32_t epoch = -1);

  // Gives the session back, once; at the program's end, too. Others would wait for a client in
  // lockstep whose LEAVE was lost: it is repeated until its reply, for a moment, since the server
  // may be gone: in that case no longer than that is unknown. It waits for no other request: a
  // callback in step() that ends the program may be in one.
  void leave();
  void on_reply(const uint8_t* bytes, size_t size);  // a message of ruedo/reply

 private:
  void join(Duration timeout);
  void repeat_leave(std::unique_lock<std::mutex>& lock);
  void send(int32_t kind, int64_t session, int64_t sequence, const std::vector<uint8_t>& body,
            int32_t epoch);
  Reply exchange(int32_t kind, int64_t session, int64_t sequence, const std::vector<uint8_t>& body,
                 Duration timeout);

  Core& core_;
  const std::string name_;
  std::mutex one_at_a_time_;
  std::atomic<int64_t> run_id_ = 0, sequence_ = 0;  // changed under one_at_a_time_, or by leave()

  std::mutex mutex_;
  std::condition_variable news_;
  std::atomic<int64_t> session_ = 0;
  int32_t awaited_kind_ = 0;  // 0: none
  int64_t awaited_sequence_ = 0;
  std::optional<Reply> reply_;
  std::atomic<bool> leaving_ = false;
  bool left_ = false;  // a LEAVE was answered
  bool gone_ = false;  // leave() has returned
  const AtProgramEnd at_program_end_{[this] { leave(); }};
};

template <class Message>
std::vector<uint8_t> encoded(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace ruedo::client
