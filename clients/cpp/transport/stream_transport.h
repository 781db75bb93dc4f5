// tcpq's frames, over TCP or over a Unix-domain socket to a server on this machine: no other user
// reads that, nothing is lost, and it is faster.
//
// LCM's own TCP is not used: it waits for the rest of a message without end, and takes memory for
// whatever length a server names.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "bus/lcm_url.h"
#include "bus/stream_connection.h"
#include "transport/transport.h"

namespace ruedo::client {

// Connects again when the server comes back.
class StreamTransport : public Transport {
 public:
  explicit StreamTransport(const bus::LcmUrl& address);  // throws NoServer

  void subscribe(const std::string& channel) override;
  void unsubscribe(const std::string& channel) override;
  void publish(const std::string& channel, const uint8_t* bytes, size_t size) override;
  bool receive(std::chrono::milliseconds timeout, const Receiver& receiver) override;
  bool has_news() override;
  bool is_connected() override { return connection() != nullptr; }

 private:
  std::shared_ptr<bus::StreamConnection> connection();
  void connect();  // throws EnvironmentError
  bool receive(bus::StreamConnection& from, const Receiver& receiver);

  const bus::LcmUrl address_;
  std::mutex mutex_;
  std::shared_ptr<bus::StreamConnection> connection_;  // null without a server
  std::set<std::string> channels_;
  std::atomic<bool> busy_{false};  // receive() takes something
};

}  // namespace ruedo::client
