// What only LCM itself can carry, as a transport: memq and logs.
//
// LCM's calls are not safe beside each other, so one lock is around them: lcm_unsubscribe() changes
// the list that a dispatch in another thread walks through. Messages are handed over after the lock
// was released, and waiting is done without it.
#pragma once

#include <lcm/lcm.h>

#include <map>
#include <mutex>
#include <string>
#include <vector>

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

 private:
  bool wait(std::chrono::milliseconds timeout);

  lcm_t* lcm_ = nullptr;
  std::mutex mutex_;  // lcm_ and what follows
  std::map<std::string, lcm_subscription_t*> subscriptions_;
  bool arrived_ = false;
  std::string channel_;  // of what arrived
  std::vector<uint8_t> bytes_;
};

}  // namespace ruedo::client
