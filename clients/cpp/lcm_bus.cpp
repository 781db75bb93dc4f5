// LCM for the client: URLs, the check of the route, and the receiving thread.
#include "lcm_bus.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "ruedo/client.h"

namespace ruedo::client {
namespace {

constexpr std::chrono::milliseconds kLendTime(20);

struct Address { std::string scheme, host, port; };

Address split(const std::string& url) {
  Address address;
  const size_t scheme_end = url.find("://");
  if (scheme_end == std::string::npos) return address;
  address.scheme = url.substr(0, scheme_end);
  const std::string network = url.substr(scheme_end + 3, url.find('?') - scheme_end - 3);
  const size_t colon = network.rfind(':');
  address.host = network.substr(0, colon);
  if (colon != std::string::npos) address.port = network.substr(colon + 1);
  return address;
}

bool can_connect(const std::string& host, const std::string& port, int type, std::string& why) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_family = AF_INET;
  hints.ai_socktype = type;
  if (const int error = getaddrinfo(host.c_str(), port.c_str(), &hints, &found)) {
    why = gai_strerror(error);
    return false;
  }
  const int fd = socket(found->ai_family, found->ai_socktype | SOCK_CLOEXEC, 0);
  const bool connected = fd >= 0 && connect(fd, found->ai_addr, found->ai_addrlen) == 0;
  if (!connected) why = std::strerror(errno);
  if (fd >= 0) ::close(fd);
  freeaddrinfo(found);
  return connected;
}

void check_reachable(const std::string& url) {
  const Address address = split(url);
  std::string why;
  if (address.scheme == "udpm") {
    if (!has_multicast_route(address.host.empty() ? "239.255.76.67" : address.host)) {
      throw NoServer(url + ": this machine has no route for multicast. On Linux: sudo ip route add 224.0.0.0/4 dev lo; "
                           "`ruedo doctor` tells more");
    }
  } else if (address.scheme == "tcpq") {
    if (!can_connect(address.host.empty() ? "127.0.0.1" : address.host, address.port.empty() ? "7700" : address.port,
                     SOCK_STREAM, why)) {
      throw NoServer("no Ruedo server at " + url + " (" + why + "). Is `ruedo run` started with this --lcm? `ruedo doctor` "
                     "looks for what is wrong");
    }
  } else if (address.scheme != "memq" && address.scheme != "file") {
    throw NoServer(url + ": not an LCM URL; udpm://GROUP:PORT?ttl=0 or tcpq://HOST:PORT is");
  }
}

// LCM takes a regular expression.
std::string escaped(const std::string& channel) {
  std::string result;
  for (char c : channel) {
    if (std::strchr(".^$*+?{}[]\\|()", c)) result += '\\';
    result += c;
  }
  return result;
}

void dispatch(const lcm_recv_buf_t* buffer, const char*, void* handler) {
  (*static_cast<LcmBus::Handler*>(handler))(static_cast<const uint8_t*>(buffer->data), buffer->data_size);
}

}  // namespace

std::string resolve_url(const std::string& url) {
  if (!url.empty()) return url;
  const char* named = std::getenv("LCM_DEFAULT_URL");
  if (named && *named) return named;
  // What `ruedo run` serves by itself: TCP where multicast has no route.
  return has_multicast_route() ? "udpm://239.255.76.67:7667?ttl=0" : "tcpq://127.0.0.1:7700";
}

bool is_served(const std::string& url) {
  const Address address = split(url);
  std::string why;
  return address.scheme != "tcpq" || can_connect(address.host.empty() ? "127.0.0.1" : address.host,
                                                 address.port.empty() ? "7700" : address.port, SOCK_STREAM, why);
}

bool has_multicast_route(const std::string& group) {
  std::string why;
  return can_connect(group, "7667", SOCK_DGRAM, why);
}

LcmBus::LcmBus(const std::string& url) {
  check_reachable(url);
  lcm_ = lcm_create(url.c_str());
  if (!lcm_) throw NoServer(url + ": LCM cannot use it; `ruedo doctor` looks for what is wrong");
}

LcmBus::~LcmBus() {
  close();
  lcm_destroy(lcm_);
}

void LcmBus::start() { thread_ = std::thread([this] { receive(); }); }

void LcmBus::subscribe(const std::string& channel, Handler handler) {
  auto kept = std::make_shared<Handler>(std::move(handler));
  {
    std::lock_guard lock(mutex_);
    handlers_[channel].push_back(kept);
  }
  lcm_subscribe(lcm_, escaped(channel).c_str(), dispatch, kept.get());
}

void LcmBus::publish(const std::string& channel, const uint8_t* bytes, size_t size) {
  if (!closed_) lcm_publish(lcm_, channel.c_str(), bytes, static_cast<unsigned int>(size));
}

void LcmBus::close() {
  closed_ = true;
  if (thread_.joinable()) thread_.join();
}

void LcmBus::handle(int timeout_ms) {
  // tcpq: when the server is gone, those who wait find out by their timeouts.
  if (lcm_handle_timeout(lcm_, timeout_ms) < 0) std::this_thread::sleep_for(std::chrono::milliseconds(std::min(timeout_ms, 100)));
}

void LcmBus::receive() {
  while (!closed_) {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    const std::chrono::steady_clock::duration lent(lent_until_);
    if (now < lent) {
      std::this_thread::sleep_for(std::min<std::chrono::steady_clock::duration>(lent - now, kLendTime));
    } else {
      std::lock_guard turn(receiving_);
      handle(100);
    }
  }
}

LcmBus::Turn::Turn(LcmBus& bus) : bus_(bus) {
  bus_.lent_until_ = std::numeric_limits<std::chrono::steady_clock::rep>::max();
  bus_.receiving_.lock();
}

LcmBus::Turn::~Turn() {
  bus_.lent_until_ = (std::chrono::steady_clock::now() + kLendTime).time_since_epoch().count();
  bus_.receiving_.unlock();
}

void LcmBus::Turn::handle(std::chrono::steady_clock::duration timeout) {
  const auto rounded = std::chrono::ceil<std::chrono::milliseconds>(timeout).count();
  bus_.handle(static_cast<int>(std::clamp<int64_t>(rounded, 0, 1000)));
}

}  // namespace ruedo::client
