// LCM's multicast as a transport.
#include "multicast_transport.h"

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
  const std::string url = address.str();  // whole: without a port LCM would send to port 0
  lcm_.reset(lcm_create(url.c_str()));
  try {
    if (!lcm_) throw std::system_error(std::make_error_code(std::errc::invalid_argument));
    receiver_ = std::make_unique<bus::MulticastReceiver>(
        address.host, address.port,
        std::max(std::atoi(address.option("recv_buf_size", "0").c_str()), kReceiveBuffer));
  } catch (const std::system_error&) {
    throw NoServer(url + ": LCM cannot use it; `ruedo doctor` looks for what is wrong");
  }
}

void MulticastTransport::publish(const std::string& channel, const uint8_t* bytes, size_t size) {
  lcm_publish(lcm_.get(), channel.c_str(), bytes, static_cast<unsigned int>(size));
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
    const bool any = receiver_->take(receiver);
    busy_ = false;
    if (any) return true;
  } while (looks_again_ && may_look_again && timeout.count() > 0 &&
           std::chrono::steady_clock::now() < sleep_at);
  pollfd waiting{receiver_->file(), POLLIN, 0};
  ::poll(&waiting, 1, static_cast<int>(timeout.count()));
  return false;
}

}  // namespace ruedo::client
