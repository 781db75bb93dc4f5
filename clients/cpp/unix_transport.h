// A Unix-domain socket to a server on this machine: no other user reads it, nothing is lost, and it
// is faster.
#pragma once

#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "bus/unix_connection.h"
#include "transport.h"

namespace ruedo::client {

// Connects again when the server comes back.
class UnixTransport : public Transport {
 public:
  explicit UnixTransport(const std::string& path);  // throws NoServer

  void subscribe(const std::string& channel) override;
  void unsubscribe(const std::string& channel) override;
  void publish(const std::string& channel, const uint8_t* bytes, size_t size) override;
  bool receive(std::chrono::milliseconds timeout, const Receiver& receiver) override;

 private:
  std::shared_ptr<bus::UnixConnection> connection();
  void connect();  // with the mutex held

  const std::string path_;
  std::mutex mutex_;
  std::shared_ptr<bus::UnixConnection> connection_;  // null: there is no server
  std::set<std::string> channels_;
};

}  // namespace ruedo::client
