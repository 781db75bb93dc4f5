// LCM as a transport.
#include "lcm_transport.h"

#include <poll.h>

#include <cstring>

#include "address.h"
#include "multicast_transport.h"
#include "ruedo/client.h"
#include "stream_transport.h"

namespace ruedo::client {
namespace {

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
  if (address.scheme == "udpm") return std::make_unique<MulticastTransport>(url);
  return std::make_unique<LcmTransport>(url);
}

LcmTransport::LcmTransport(const std::string& url) : lcm_(lcm_create(url.c_str())) {
  if (!lcm_) throw NoServer(url + ": LCM cannot use it; `ruedo doctor` looks for what is wrong");
}

LcmTransport::~LcmTransport() { lcm_destroy(lcm_); }

void LcmTransport::subscribe(const std::string& channel) {
  const auto arrive = [](const lcm_recv_buf_t* buffer, const char* name, void* transport) {
    auto& self = *static_cast<LcmTransport*>(transport);
    const auto* bytes = static_cast<const uint8_t*>(buffer->data);
    self.arrived_ = true;
    self.channel_ = name;
    self.bytes_.assign(bytes, bytes + buffer->data_size);
  };
  const std::lock_guard lock(mutex_);
  subscriptions_[channel] = lcm_subscribe(lcm_, escaped(channel).c_str(), arrive, this);
}

void LcmTransport::unsubscribe(const std::string& channel) {
  const std::lock_guard lock(mutex_);
  const auto found = subscriptions_.find(channel);
  if (found == subscriptions_.end()) return;
  lcm_unsubscribe(lcm_, found->second);
  subscriptions_.erase(found);
}

void LcmTransport::publish(const std::string& channel, const uint8_t* bytes, size_t size) {
  const std::lock_guard lock(mutex_);
  lcm_publish(lcm_, channel.c_str(), bytes, static_cast<unsigned int>(size));
}

bool LcmTransport::receive(std::chrono::milliseconds timeout, const Receiver& receiver) {
  if (!wait(timeout)) return false;
  bool arrived = false;
  {
    const std::lock_guard lock(mutex_);
    lcm_handle_timeout(lcm_, 0);
    std::swap(arrived, arrived_);
  }
  if (arrived) receiver(channel_, bytes_.data(), bytes_.size());
  return arrived;
}

bool LcmTransport::wait(std::chrono::milliseconds timeout) {
  pollfd waiting{-1, POLLIN, 0};
  {
    const std::lock_guard lock(mutex_);
    waiting.fd = lcm_get_fileno(lcm_);
  }
  return ::poll(&waiting, 1, static_cast<int>(timeout.count())) > 0;
}

}  // namespace ruedo::client
