// Address parsing and the checks of the multicast route.
#include "bus/lcm_url.h"

#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "ruedo/errors.h"

namespace ruedo::bus {
namespace {

class Socket {
 public:
  Socket() : file_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (file_ >= 0) ::close(file_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int get() const { return file_; }

 private:
  int file_;
};

sockaddr_in address_of(const LcmUrl& url) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(url.port);
  ::inet_pton(AF_INET, url.host.c_str(), &address.sin_addr);
  return address;
}

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw InputError({}, "--lcm '" + text + "': " + why + "; an address looks like " + kDefaultUrl);
}

}  // namespace

std::string LcmUrl::str() const {
  std::string text = scheme + "://" + host;
  if (port != 0) text += ":" + std::to_string(port);
  if (!options.empty()) text += "?" + options;
  return text;
}

std::string LcmUrl::option(const std::string& key, const std::string& fallback) const {
  for (size_t at = 0; at < options.size();) {
    const size_t end = std::min(options.find('&', at), options.size());
    const std::string pair = options.substr(at, end - at);
    if (pair.rfind(key + "=", 0) == 0) return pair.substr(key.size() + 1);
    at = end + 1;
  }
  return fallback;
}

LcmUrl parse_url(const std::string& text) {
  if (text.empty()) {
    const char* environment = std::getenv("LCM_DEFAULT_URL");
    return parse_url(environment && *environment ? environment : kDefaultUrl);
  }
  LcmUrl url;
  const size_t scheme_end = text.find("://");
  if (scheme_end == std::string::npos) refuse(text, "it has no scheme");
  url.scheme = text.substr(0, scheme_end);
  if (url.scheme != "udpm" && url.scheme != "memq") refuse(text, "the schemes udpm and memq are supported");
  std::string rest = text.substr(scheme_end + 3);
  if (const size_t question = rest.find('?'); question != std::string::npos) {
    url.options = rest.substr(question + 1);
    rest.resize(question);
  }
  if (url.scheme == "memq") return url;
  if (const size_t colon = rest.find(':'); colon != std::string::npos) {
    const std::string digits = rest.substr(colon + 1);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), url.port);
    if (error != std::errc() || end != digits.data() + digits.size() || url.port == 0) refuse(text, "'" + digits + "' is no port");
    rest.resize(colon);
  }
  url.host = rest.empty() ? "239.255.76.67" : rest;
  if (url.port == 0) url.port = 7667;
  in_addr group{};
  if (::inet_pton(AF_INET, url.host.c_str(), &group) != 1 || !IN_MULTICAST(ntohl(group.s_addr))) {
    refuse(text, "'" + url.host + "' is no multicast group (224.0.0.0 to 239.255.255.255)");
  }
  if (url.option("ttl", "").empty()) url.options += (url.options.empty() ? "ttl=0" : "&ttl=0");
  return url;
}

void check_route(const LcmUrl& url) {
  if (url.scheme != "udpm") return;
  const Socket socket;
  const sockaddr_in address = address_of(url);
  if (socket.get() >= 0 && ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return;
  throw EnvironmentError("no route to the multicast group " + url.host + " (" + std::strerror(errno) +
                         "): connect to a network, or run: sudo ip link set lo up multicast on; sudo ip route add " + url.host +
                         "/32 dev lo");
}

bool hears_itself(const LcmUrl& url, int timeout_ms) {
  if (url.scheme != "udpm") return true;
  const Socket receiver, sender;
  const int on = 1;
  ::setsockopt(receiver.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  ::setsockopt(receiver.get(), SOL_SOCKET, SO_REUSEPORT, &on, sizeof on);
  sockaddr_in address = address_of(url);
  sockaddr_in any = address;
  any.sin_addr.s_addr = htonl(INADDR_ANY);
  ip_mreq membership{address.sin_addr, any.sin_addr};
  if (::bind(receiver.get(), reinterpret_cast<const sockaddr*>(&any), sizeof any) != 0 ||
      ::setsockopt(receiver.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
    return false;
  }
  const unsigned char ttl = 0;
  ::setsockopt(sender.get(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  // A whole LCM message (magic "LC02", sequence 0, channel, no data), so that others on the group can make sense of it.
  const char probe[] = "LC02\0\0\0\0RUEDO_SELF_TEST";
  if (::sendto(sender.get(), probe, sizeof probe, 0, reinterpret_cast<const sockaddr*>(&address), sizeof address) < 0) return false;
  for (;;) {
    pollfd waiting{receiver.get(), POLLIN, 0};
    if (::poll(&waiting, 1, timeout_ms) <= 0) return false;
    char buffer[64];
    const ssize_t size = ::recv(receiver.get(), buffer, sizeof buffer, 0);
    if (size == static_cast<ssize_t>(sizeof probe) && std::memcmp(buffer, probe, sizeof probe) == 0) return true;
  }
}

int64_t receive_buffer_limit() {
  std::ifstream file("/proc/sys/net/core/rmem_max");
  int64_t limit = -1;
  return file >> limit ? limit : -1;
}

}  // namespace ruedo::bus
