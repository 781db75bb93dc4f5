// The interface of transports, which carry messages.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace ruedo::client {

// receive() is called by one thread at a time, the rest by any, also while receive() waits or its
// receiver runs.
class Transport {
 public:
  using Receiver = std::function<void(std::string_view channel, const uint8_t* bytes, size_t size)>;

  virtual ~Transport() = default;
  virtual void subscribe(const std::string& channel) = 0;  // from the return on, every message of
                                                           // that channel is received
  virtual void unsubscribe(const std::string& channel) = 0;
  virtual void publish(const std::string& channel, const uint8_t* bytes, size_t size) = 0;
  // Hands over what has come, or waits for it at most so long and returns false.
  virtual bool receive(std::chrono::milliseconds timeout, const Receiver& receiver) = 0;
  // Something waits for receive(), or its receiver has not seen all of what it took.
  virtual bool has_news() { return false; }
  // False: nothing can be sent without a server.
  virtual bool is_connected() { return true; }
  // From now on without sleeping between messages that follow each other closely, as in lockstep.
  // Not while another thread receives.
  virtual void receive_eagerly() {}
};

// Throws NoServer, with the cure, when nothing can come from that URL.
std::unique_ptr<Transport> open_transport(const std::string& url);

}  // namespace ruedo::client
