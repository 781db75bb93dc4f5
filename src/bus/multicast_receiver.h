// Receives what LCM programs send by multicast, in the caller's thread.
//
// LCM itself puts a thread and a pipe in between, which takes longer than a message does. The wire
// format is LCM's ("udpm"): short messages in one datagram, long ones in fragments. Needs nothing
// but the system: the C++ client is built with it, too.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "system/file_handle.h"

namespace ruedo::bus {

// Not thread safe.
class MulticastReceiver {
 public:
  using Handler = std::function<void(std::string_view channel, const uint8_t* data, size_t size)>;

  static constexpr size_t kLongestChannel = 63;  // LCM's
  static constexpr size_t kLongestMessage = 64u << 20;
  static constexpr size_t kMostPartial = 80u << 20;  // memory of messages that are not whole yet
  static constexpr size_t kMostMessages = 64;        // of these, and of each sender
  static constexpr size_t kMostOfSender = 4;

  // Joins the group. buffer: bytes of the socket's buffer, 0: the system's. Throws
  // std::system_error.
  MulticastReceiver(const std::string& group, uint16_t port, int buffer);

  int file() const { return socket_.get(); }  // readable when receive() has something

  struct Sender {
    uint32_t address = 0;  // IPv4 and port, in the host's byte order
    uint16_t port = 0;
    bool operator==(const Sender&) const = default;
  };

  // Takes one datagram, and calls the handler when it completes a message. False: none waits.
  // Datagrams that are not LCM's are ignored.
  bool receive(const Handler& handler);
  // The same for a datagram that came in another way.
  void read(const uint8_t* bytes, size_t size, Sender sender, const Handler& handler);

  Sender sender() const { return sender_; }  // of the datagram that was taken last
  // Has the kernel drop that sender's datagrams; false where the system cannot.
  bool ignore(Sender sender);

 private:
  struct Fragment {
    size_t offset = 0;
    std::vector<uint8_t> data;
  };
  // A message that is not whole yet: several threads of a sender's may send at once. It takes the
  // memory of what has come, not of what its sender says is to come.
  struct Partial {
    Sender sender;
    uint32_t sequence = 0;
    size_t size = 0, count = 0;  // bytes and fragments of the whole
    std::string channel;
    std::map<size_t, Fragment> fragments;  // by number
    size_t memory = 0;
  };
  using Partials = std::list<Partial>;

  void take_fragment(const uint8_t* bytes, size_t size, const Handler& handler);
  Partials::iterator partial_of(uint32_t sequence, size_t size, size_t count);
  void forget(Partials::iterator partial);
  static std::optional<std::vector<uint8_t>> joined(const std::map<size_t, Fragment>& fragments,
                                                    size_t size);

  FileHandle socket_;
  Sender sender_;
  std::vector<uint8_t> datagram_;
  Partials partials_;  // the newest last
  size_t partial_memory_ = 0;
};

}  // namespace ruedo::bus
