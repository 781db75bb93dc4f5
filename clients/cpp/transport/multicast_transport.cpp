// LCM's multicast as a transport.
#include "transport/multicast_transport.h"

#include <poll.h>

#include <algorithm>
#include <cstdlib>
#include <system_error>
#include <thread>

#include "ruedo/client.h"

namespace ruedo::client {
namespace {

constexpr std::chrono::microseconds kLookTime(50);
constexpr int kReceiveBuffer = 2 << 20;  // bytes; the system gives at most its own limit

}  // namespace

MulticastTransport::MulticastTransport(const bus::LcmUrl& address) {
  const auto number = [&](const char* option) {
    return std::atoi(address.option(option, "0").c_str());
  };
  try {
    sender_ = std::make_unique<bus::MulticastSender>(address.host, address.port, number("ttl"));
    receiver_ = std::make_unique<bus::MulticastReceiver>(
        address.host, address.port, std::max(number("recv_buf_size"), kReceiveBuffer));
  } catch (const std::system_error& error) {
    throw NoServer(address.str() + ": it cannot be used (" + error.what() +
                   "); `ruedo doctor` looks for what is wrong");
  }
}

void MulticastTransport::publish(const std::string& channel, const uint8_t* bytes, size_t size) {
  sender_->send(channel, bytes, size);
}

bool MulticastTransport::has_news() {
  pollfd waiting{receiver_->file(), POLLIN, 0};
  // In that order: what has left the socket is in hand.
  return ::poll(&waiting, 1, 0) > 0 || busy_;
}

bool MulticastTransport::receive(std::chrono::milliseconds timeout, const Receiver& receiver) {
  // Waking a thread takes as long as a step of a small world: poll before sleeping.
  static const bool may_look_again = std::thread::hardware_concurrency() > 1;
  const auto sleep_at = std::chrono::steady_clock::now() + kLookTime;
  do {
    busy_ = true;
    const bool any = receiver_->receive(receiver);
    busy_ = false;
    if (any) return true;
  } while (looks_again_ && may_look_again && timeout.count() > 0 &&
           std::chrono::steady_clock::now() < sleep_at);
  pollfd waiting{receiver_->file(), POLLIN, 0};
  ::poll(&waiting, 1, static_cast<int>(timeout.count()));
  return false;
}

}  // namespace ruedo::client
