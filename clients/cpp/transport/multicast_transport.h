// LCM's multicast as a transport.
//
// All channels come; what waits is in the socket's buffer alone, for all channels together.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "bus/lcm_url.h"
#include "bus/multicast_receiver.h"
#include "bus/multicast_sender.h"
#include "transport/transport.h"

namespace ruedo::client {

class MulticastTransport : public Transport {
 public:
  explicit MulticastTransport(const bus::LcmUrl& address);  // throws NoServer

  void subscribe(const std::string&) override {}
  void unsubscribe(const std::string&) override {}
  void publish(const std::string& channel, const uint8_t* bytes, size_t size) override;
  bool receive(std::chrono::milliseconds timeout, const Receiver& receiver) override;
  bool has_news() override;
  void receive_eagerly() override { looks_again_ = true; }

 private:
  std::unique_ptr<bus::MulticastSender> sender_;
  std::unique_ptr<bus::MulticastReceiver> receiver_;
  bool looks_again_ = false;
  std::atomic<bool> busy_{false};  // receive() takes something
};

}  // namespace ruedo::client
