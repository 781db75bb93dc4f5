// Address parsing and the checks of the multicast route.
#include "bus/lcm_url.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <set>

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include "bus/unix_socket.h"
#include "ruedo/errors.h"
#include "system/file_handle.h"

namespace ruedo::bus {
namespace {

FileHandle datagram_socket() { return FileHandle(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)); }

sockaddr_in address_of(const LcmUrl& url) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(url.port);
  ::inet_pton(AF_INET, url.host.c_str(), &address.sin_addr);
  return address;
}

// A host's IPv4 address; "" if it has none.
std::string resolved(const std::string& host) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  if (::getaddrinfo(host.c_str(), nullptr, &hints, &found) != 0) return "";
  char text[INET_ADDRSTRLEN] = "";
  ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr, text,
              sizeof text);
  ::freeaddrinfo(found);
  return text;
}

// `given`: the text and its source, for errors.
[[noreturn]] void refuse(const std::string& given, const std::string& why) {
  throw InputError({}, given + ": " + why + "; an address looks like " + kDefaultUrl +
                           ", tcpq://127.0.0.1:7700 or unix:///tmp/ruedo.sock");
}

// A whole number from `least` to `most`.
bool is_number(const std::string& digits, int64_t least, int64_t most) {
  int64_t value = 0;
  const char* const end = digits.data() + digits.size();
  const auto [read, error] = std::from_chars(digits.data(), end, value);
  return error == std::errc() && read == end && value >= least && value <= most;
}

// LCM takes any option, and any number for the ttl, with a line of its own at most.
void check_options(const std::string& given, const std::string& options) {
  std::set<std::string> seen;
  for (size_t at = 0; at < options.size();) {
    const size_t end = std::min(options.find('&', at), options.size());
    const std::string pair = options.substr(at, end - at);
    const size_t equals = std::min(pair.find('='), pair.size());
    const std::string key = pair.substr(0, equals),
                      value = pair.substr(std::min(equals + 1, pair.size()));
    const bool good = (key == "ttl" && is_number(value, 0, 255)) ||
                      (key == "recv_buf_size" && is_number(value, 1, INT_MAX));
    if (!good || !seen.insert(key).second)
      refuse(given, "the option '" + pair +
                        "' is not allowed: ttl, 0 to 255, and recv_buf_size, 1 to 2147483647 "
                        "bytes, are, each once");
    at = end + 1;
  }
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

LcmUrl parse_url(const std::string& text, const std::string& given_by) {
  if (text.empty()) {
    const char* environment = std::getenv("LCM_DEFAULT_URL");
    return parse_url(environment && *environment ? environment : kDefaultUrl, "LCM_DEFAULT_URL");
  }
  const std::string given = given_by + " '" + text + "'";
  LcmUrl url;
  const size_t scheme_end = text.find("://");
  if (scheme_end == std::string::npos) refuse(given, "it has no scheme");
  url.scheme = text.substr(0, scheme_end);
  if (url.scheme != "udpm" && url.scheme != "tcpq" && url.scheme != "memq" &&
      url.scheme != "unix") {
    refuse(given, "the schemes udpm, tcpq, unix and memq are supported");
  }
  std::string rest = text.substr(scheme_end + 3);
  if (url.scheme == "unix") {
    if (rest.empty() || rest[0] != '/') refuse(given, "'" + rest + "' is not an absolute path");
    url.host = rest;
    return url;
  }
  if (const size_t question = rest.find('?'); question != std::string::npos) {
    url.options = rest.substr(question + 1);
    rest.resize(question);
  }
  if (url.scheme != "udpm" && !url.options.empty()) refuse(given, url.scheme + " has no options");
  if (url.scheme == "memq") return url;
  if (rest.starts_with('['))
    refuse(given, "LCM has no IPv6: '" + rest + "' is not allowed; give a name or an IPv4 address");
  if (const size_t colon = rest.find(':'); colon != std::string::npos) {
    const std::string digits = rest.substr(colon + 1);
    if (!is_number(digits, 1, UINT16_MAX)) refuse(given, "'" + digits + "' is not a port");
    url.port = static_cast<uint16_t>(std::stoi(digits));
    rest.resize(colon);
  }
  if (url.scheme == "tcpq") {
    if (url.port == 0) url.port = kDefaultTcpPort;
    url.host = rest.empty() ? "127.0.0.1" : resolved(rest);
    if (url.host.empty()) refuse(given, "'" + rest + "' is not a host that this machine knows");
    return url;
  }
  url.host = rest.empty() ? "239.255.76.67" : rest;
  if (url.port == 0) url.port = 7667;
  in_addr group{};
  if (::inet_pton(AF_INET, url.host.c_str(), &group) != 1 || !IN_MULTICAST(ntohl(group.s_addr))) {
    refuse(given, "'" + url.host + "' is not a multicast group (224.0.0.0 to 239.255.255.255)");
  }
  check_options(given, url.options);
  if (url.option("ttl", "").empty()) url.options += (url.options.empty() ? "ttl=0" : "&ttl=0");
  return url;
}

bool has_route(const LcmUrl& url) {
  const FileHandle socket = datagram_socket();
  const sockaddr_in address = address_of(url);
  return socket &&
         ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

void check_route(const LcmUrl& url) {
  if (url.scheme != "udpm" || has_route(url)) return;
  throw EnvironmentError(
      "no route to the multicast group " + url.host + " (" + std::strerror(errno) +
      "): connect to a network, or run: sudo ip link set lo up multicast on; sudo ip route add " +
      url.host + "/32 dev lo");
}

bool is_served(const LcmUrl& url, int timeout_ms) {
  if (url.scheme == "unix") return is_unix_served(url.host);
  const FileHandle socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const sockaddr_in address = address_of(url);
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    return true;
  if (errno != EINPROGRESS) return false;
  pollfd waiting{socket.get(), POLLOUT, 0};
  int error = 0;
  socklen_t size = sizeof error;
  return ::poll(&waiting, 1, timeout_ms) == 1 &&
         ::getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &error, &size) == 0 && error == 0;
}

bool hears_itself(const LcmUrl& url, int timeout_ms) {
  if (url.scheme != "udpm") return true;
  const FileHandle receiver = datagram_socket(), sender = datagram_socket();
  const int on = 1;
  ::setsockopt(receiver.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  ::setsockopt(receiver.get(), SOL_SOCKET, SO_REUSEPORT, &on, sizeof on);
  sockaddr_in address = address_of(url);
  sockaddr_in any = address;
  any.sin_addr.s_addr = htonl(INADDR_ANY);
  ip_mreq membership{address.sin_addr, any.sin_addr};
  if (::bind(receiver.get(), reinterpret_cast<const sockaddr*>(&any), sizeof any) != 0 ||
      ::setsockopt(receiver.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) !=
          0) {
    return false;
  }
  const unsigned char ttl = 0;
  ::setsockopt(sender.get(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  // A whole LCM message (magic "LC02", sequence 0, channel, no data), so that others on the group
  // can make sense of it.
  const char probe[] = "LC02\0\0\0\0RUEDO_SELF_TEST";
  if (::sendto(sender.get(), probe, sizeof probe, 0, reinterpret_cast<const sockaddr*>(&address),
               sizeof address) < 0)
    return false;
  for (;;) {
    pollfd waiting{receiver.get(), POLLIN, 0};
    if (::poll(&waiting, 1, timeout_ms) <= 0) return false;
    char buffer[64];
    const ssize_t size = ::recv(receiver.get(), buffer, sizeof buffer, 0);
    if (size == static_cast<ssize_t>(sizeof probe) && std::memcmp(buffer, probe, sizeof probe) == 0)
      return true;
  }
}

namespace {

int64_t kernel_setting(const char* path) {
  std::ifstream file(path);
  int64_t value = -1;
  return file >> value ? value : -1;
}

}  // namespace

int64_t receive_buffer_limit() { return kernel_setting("/proc/sys/net/core/rmem_max"); }

int64_t receive_buffer(const LcmUrl& url) {
  if (url.scheme != "udpm") return -1;
  const int64_t asked = std::atoll(url.option("recv_buf_size", "0").c_str());
  return asked > 0 ? std::min(asked, receive_buffer_limit())
                   : kernel_setting("/proc/sys/net/core/rmem_default");
}

}  // namespace ruedo::bus
