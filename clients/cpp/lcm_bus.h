// The LCM side of a client: one LCM instance, one thread that receives, raw bytes to handlers.
//
// The route is checked before the first subscription, because LCM's own self-test blocks for ten seconds where
// multicast has no route.
#pragma once

#include <lcm/lcm.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "bus/multicast_receiver.h"

namespace ruedo::client {

// Or LCM_DEFAULT_URL, or LCM's default with ttl 0, or TCP where multicast has no route.
std::string resolve_url(const std::string& url);
bool has_multicast_route(const std::string& group = "239.255.76.67");
bool is_claimed(const std::string& url);   // by a server on this machine: its claim goes with its process
bool is_served(const std::string& url);    // false for a tcpq address where nobody listens

// Thread safe. Handlers run in the receiving thread, one at a time.
class LcmBus {
 public:
  using Handler = std::function<void(const uint8_t* bytes, size_t size)>;

  explicit LcmBus(const std::string& url);    // throws NoServer, with the cure
  ~LcmBus();

  void start();    // begins to receive; at least one subscription comes first
  void subscribe(const std::string& channel, Handler handler);
  void publish(const std::string& channel, const uint8_t* bytes, size_t size);
  // From now on without LCM's own thread, where the network is multicast: a message comes in half the time. What waits is
  // then in the socket's buffer alone, for all channels together: for lockstep, which fetches again what was lost.
  void receive_directly();
  void close();    // not from a handler

  // Who waits for much may receive for himself: handing each message from thread to thread takes as long as getting it.
  // While one of these lives, and a moment longer, the receiving thread sleeps, and handle() runs the handlers.
  class Turn {
   public:
    explicit Turn(LcmBus& bus);
    ~Turn();
    void handle(std::chrono::steady_clock::duration timeout);    // one message, or until the time is over

   private:
    LcmBus& bus_;
  };

  template <class Message>
  void publish(const std::string& channel, const Message& message) {
    std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    publish(channel, bytes.data(), bytes.size());
  }

 private:
  void receive();
  void handle(int timeout_ms);
  void deliver(std::string_view channel, const uint8_t* bytes, size_t size);

  const std::string url_;
  lcm_t* lcm_ = nullptr;         // sends; receives, too, where the network is not multicast
  lcm_t* receiver_ = nullptr;    // null once there is a direct one
  std::unique_ptr<bus::MulticastReceiver> direct_;
  std::mutex mutex_;
  std::map<std::string, std::vector<std::shared_ptr<Handler>>, std::less<>> handlers_;
  std::atomic<bool> closed_{false};
  std::mutex receiving_;
  std::atomic<std::chrono::steady_clock::rep> lent_until_{0};
  std::thread thread_;
};

}  // namespace ruedo::client
