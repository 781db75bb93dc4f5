// LCM as a transport.
#include "lcm_transport.h"

#include <poll.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <thread>

#include "address.h"
#include "ruedo/client.h"
#include "stream_transport.h"

namespace ruedo::client {
namespace {

constexpr std::chrono::microseconds kLookTime(50);

// LCM takes a regular expression.
std::string escaped(const std::string& channel) {
  std::string result;
  for (char c : channel) {
    if (std::strchr(".^$*+?{}[]\\|()", c)) result += '\\';
    result += c;
  }
  return result;
}

}  // namespace

std::unique_ptr<Transport> open_transport(const std::string& url) {
  check_reachable(url);
  const Address address = split(url);
  if (address.scheme == "unix" || address.scheme == "tcpq")
    return std::make_unique<StreamTransport>(address);
  return std::make_unique<LcmTransport>(url);
}

LcmTransport::LcmTransport(const std::string& url)
    : url_(url), multicast_(split(url).scheme == "udpm") {
  lcm_ = lcm_create(url.c_str());
  receiver_ = lcm_ && multicast_ ? lcm_create(url.c_str()) : lcm_;
  if (receiver_) return;
  if (lcm_) lcm_destroy(lcm_);
  throw NoServer(url + ": LCM cannot use it; `ruedo doctor` looks for what is wrong");
}

LcmTransport::~LcmTransport() {
  if (receiver_ && receiver_ != lcm_) lcm_destroy(receiver_);
  lcm_destroy(lcm_);
}

void LcmTransport::subscribe(const std::string& channel) {
  const auto arrive = [](const lcm_recv_buf_t* buffer, const char* name, void* transport) {
    auto& self = *static_cast<LcmTransport*>(transport);
    const auto* bytes = static_cast<const uint8_t*>(buffer->data);
    self.arrived_ = true;
    self.channel_ = name;
    self.bytes_.assign(bytes, bytes + buffer->data_size);
  };
  const std::lock_guard lock(mutex_);
  if (receiver_)
    subscriptions_[channel] = lcm_subscribe(receiver_, escaped(channel).c_str(), arrive, this);
}

void LcmTransport::unsubscribe(const std::string& channel) {
  const std::lock_guard lock(mutex_);
  const auto found = subscriptions_.find(channel);
  if (found == subscriptions_.end()) return;  // received directly
  lcm_unsubscribe(receiver_, found->second);
  subscriptions_.erase(found);
}

void LcmTransport::publish(const std::string& channel, const uint8_t* bytes, size_t size) {
  std::unique_lock lock(mutex_, std::defer_lock);
  if (!multicast_) lock.lock();  // multicast has a lock of its own
  lcm_publish(lcm_, channel.c_str(), bytes, static_cast<unsigned int>(size));
}

void LcmTransport::receive_directly() {
  if (direct_ || !multicast_) return;
  const Address address = split(url_);
  const size_t buffer = address.options.find("recv_buf_size=");
  const std::lock_guard lock(mutex_);
  try {
    direct_ = std::make_unique<bus::MulticastReceiver>(
        address.host, static_cast<uint16_t>(std::atoi(address.port.c_str())),
        buffer == std::string::npos ? 0 : std::atoi(address.options.c_str() + buffer + 14));
  } catch (const std::system_error&) {
    return;  // as it was
  }
  subscriptions_.clear();
  lcm_destroy(receiver_);
  receiver_ = nullptr;
}

bool LcmTransport::receive(std::chrono::milliseconds timeout, const Receiver& receiver) {
  if (direct_) return take(timeout, receiver);
  if (!wait(timeout)) return false;
  bool arrived = false;
  {
    const std::lock_guard lock(mutex_);
    lcm_handle_timeout(receiver_, 0);
    std::swap(arrived, arrived_);
  }
  if (arrived) receiver(channel_, bytes_.data(), bytes_.size());
  return arrived;
}

bool LcmTransport::wait(std::chrono::milliseconds timeout) {
  pollfd waiting{-1, POLLIN, 0};
  {
    const std::lock_guard lock(mutex_);
    waiting.fd = lcm_get_fileno(receiver_);
  }
  return ::poll(&waiting, 1, static_cast<int>(timeout.count())) > 0;
}

bool LcmTransport::take(std::chrono::milliseconds timeout, const Receiver& receiver) {
  // Waking a thread takes as long as a step of a small world: poll before sleeping.
  static const bool may_look_again = std::thread::hardware_concurrency() > 1;
  const auto sleep_at = std::chrono::steady_clock::now() + kLookTime;
  do {
    if (direct_->take(receiver)) return true;
  } while (may_look_again && timeout.count() > 0 && std::chrono::steady_clock::now() < sleep_at);
  pollfd waiting{direct_->file(), POLLIN, 0};
  ::poll(&waiting, 1, static_cast<int>(timeout.count()));
  return false;
}

}  // namespace ruedo::client
