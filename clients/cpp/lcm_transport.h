// LCM as a transport.
//
// LCM's calls are not safe beside each other, so one lock is around them: lcm_unsubscribe() changes
// the list that a dispatch in another thread walks through. Messages are handed over after the lock
// was released, and waiting is done without it.
#pragma once

#include <lcm/lcm.h>

#include <map>
#include <mutex>
#include <vector>

#include "bus/multicast_receiver.h"
#include "transport.h"

namespace ruedo::client {

class LcmTransport : public Transport {
 public:
  explicit LcmTransport(const std::string& url);  // throws NoServer
  ~LcmTransport() override;

  void subscribe(const std::string& channel) override;
  void unsubscribe(const std::string& channel) override;
  void publish(const std::string& channel, const uint8_t* bytes, size_t size) override;
  bool receive(std::chrono::milliseconds timeout, const Receiver& receiver) override;
  // Without LCM's own thread, where the network is multicast: a message comes in half the time.
  // What waits is then in the socket's buffer alone, for all channels together.
  void receive_directly() override;

 private:
  bool wait(std::chrono::milliseconds timeout);
  bool take(std::chrono::milliseconds timeout, const Receiver& receiver);

  const std::string url_;
  const bool multicast_;
  lcm_t* lcm_ = nullptr;       // sends; receives, too, where the network is not multicast
  lcm_t* receiver_ = nullptr;  // null once there is a direct one
  std::unique_ptr<bus::MulticastReceiver> direct_;
  std::mutex mutex_;  // receiver_ and what follows
  std::map<std::string, lcm_subscription_t*> subscriptions_;
  bool arrived_ = false;
  std::string channel_;  // of what arrived
  std::vector<uint8_t> bytes_;
};

}  // namespace ruedo::client
