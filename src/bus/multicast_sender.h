// Sends as LCM programs do by multicast. Needs nothing but the system: the C++ client is built
// with it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>

#include "system/file_handle.h"

namespace ruedo::bus {

class MulticastSender {
 public:
  // ttl: how many routers a datagram may pass; 0: this machine only. Throws std::system_error where
  // no route leads to the group.
  MulticastSender(const std::string& group, uint16_t port, int ttl);

  // From any thread. Datagrams that the system refuses are lost, as LCM's own messages are.
  void send(const std::string& channel, const uint8_t* bytes, size_t size);

 private:
  FileHandle socket_;
  std::mutex mutex_;  // LCM's own receiver puts together one message of a sender at a time
  uint32_t sequence_ = 0;
};

}  // namespace ruedo::bus
