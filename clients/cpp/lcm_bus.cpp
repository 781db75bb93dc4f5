// LCM for the client: URLs, the check of the route, and the receiving thread.
#include "lcm_bus.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <system_error>

#include "ruedo/client.h"

namespace ruedo::client {
namespace {

constexpr std::chrono::milliseconds kLendTime(20);
constexpr std::chrono::microseconds kLookTime(50);

struct Address { std::string scheme, host, port, options; };

Address split(const std::string& url) {
  Address address;
  const size_t scheme_end = url.find("://");
  if (scheme_end == std::string::npos) return address;
  address.scheme = url.substr(0, scheme_end);
  const std::string network = url.substr(scheme_end + 3, url.find('?') - scheme_end - 3);
  const size_t colon = network.rfind(':');
  address.host = network.substr(0, colon);
  if (colon != std::string::npos) address.port = network.substr(colon + 1);
  if (const size_t options = url.find('?'); options != std::string::npos) address.options = url.substr(options);
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

bool is_claimed(const std::string& url) {
  const Address address = split(url);
  const bool udpm = address.scheme == "udpm";
  const std::string host = address.host.empty() ? (udpm ? "239.255.76.67" : "127.0.0.1") : address.host;
  const std::string port = address.port.empty() ? (udpm ? "7667" : "7700") : address.port;
  const std::string claim = " @ruedo/" + address.scheme + "/" + host + ":" + port;
  std::ifstream sockets("/proc/net/unix");
  for (std::string line; std::getline(sockets, line);) {
    if (line.ends_with(claim)) return true;
  }
  return false;
}

bool has_multicast_route(const std::string& group) {
  std::string why;
  return can_connect(group, "7667", SOCK_DGRAM, why);
}

LcmBus::LcmBus(const std::string& url) : url_(url) {
  check_reachable(url);
  lcm_ = lcm_create(url.c_str());
  receiver_ = lcm_ && split(url).scheme == "udpm" ? lcm_create(url.c_str()) : lcm_;
  if (receiver_) return;
  if (lcm_) lcm_destroy(lcm_);
  throw NoServer(url + ": LCM cannot use it; `ruedo doctor` looks for what is wrong");
}

LcmBus::~LcmBus() {
  close();
  if (receiver_ && receiver_ != lcm_) lcm_destroy(receiver_);
  lcm_destroy(lcm_);
}

void LcmBus::receive_directly() {
  if (direct_ || receiver_ == lcm_) return;
  const Address address = split(url_);
  const size_t buffer = address.options.find("recv_buf_size=");
  const Turn turn(*this);
  const std::lock_guard lock(mutex_);
  try {
    direct_ = std::make_unique<bus::MulticastReceiver>(address.host.empty() ? "239.255.76.67" : address.host,
                                                       static_cast<uint16_t>(std::atoi(address.port.empty() ? "7667" : address.port.c_str())),
                                                       buffer == std::string::npos ? 0 : std::atoi(address.options.c_str() + buffer + 14));
  } catch (const std::system_error&) {
    return;    // as it was
  }
  lcm_destroy(receiver_);
  receiver_ = nullptr;
}

void LcmBus::start() { thread_ = std::thread([this] { receive(); }); }

void LcmBus::subscribe(const std::string& channel, Handler handler) {
  auto kept = std::make_shared<Handler>(std::move(handler));
  const std::lock_guard lock(mutex_);
  handlers_[channel].push_back(kept);
  if (receiver_) lcm_subscribe(receiver_, escaped(channel).c_str(), dispatch, kept.get());
}

void LcmBus::publish(const std::string& channel, const uint8_t* bytes, size_t size) {
  if (!closed_) lcm_publish(lcm_, channel.c_str(), bytes, static_cast<unsigned int>(size));
}

void LcmBus::close() {
  closed_ = true;
  if (thread_.joinable()) thread_.join();
}

void LcmBus::deliver(std::string_view channel, const uint8_t* bytes, size_t size) {
  for (size_t i = 0;; ++i) {    // a handler may subscribe
    Handler* handler;
    {
      const std::lock_guard lock(mutex_);
      const auto found = handlers_.find(channel);
      if (found == handlers_.end() || i >= found->second.size()) return;
      handler = found->second[i].get();
    }
    (*handler)(bytes, size);
  }
}

void LcmBus::handle(int timeout_ms) {
  if (direct_) {
    const auto take = [this](std::string_view channel, const uint8_t* bytes, size_t size) { deliver(channel, bytes, size); };
    // Being woken takes as long as a small world's step: it is mostly there before one would sleep.
    static const bool may_look_again = std::thread::hardware_concurrency() > 1;
    const auto sleep_at = std::chrono::steady_clock::now() + kLookTime;
    do {
      if (direct_->take(take)) return;
    } while (may_look_again && timeout_ms > 0 && std::chrono::steady_clock::now() < sleep_at);
    pollfd waiting{direct_->file(), POLLIN, 0};
    ::poll(&waiting, 1, timeout_ms);
    return;
  }
  // tcpq: when the server is gone, those who wait find out by their timeouts.
  if (lcm_handle_timeout(receiver_, timeout_ms) < 0) std::this_thread::sleep_for(std::chrono::milliseconds(std::min(timeout_ms, 100)));
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
