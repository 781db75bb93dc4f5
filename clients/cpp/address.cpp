// LCM URLs.
#include "address.h"

#include <netdb.h>
#include <sys/socket.h>

#include <cstdlib>
#include <fstream>

#include "bus/stream_socket.h"
#include "bus/unix_socket.h"
#include "core/file_handle.h"
#include "ruedo/client.h"
#include "ruedo/errors.h"

namespace ruedo::client {
namespace {

bool has_route(const std::string& group, const std::string& port) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  if (getaddrinfo(group.c_str(), port.c_str(), &hints, &found) != 0) return false;
  const FileHandle socket(::socket(found->ai_family, found->ai_socktype | SOCK_CLOEXEC, 0));
  const bool connected = socket && ::connect(socket.get(), found->ai_addr, found->ai_addrlen) == 0;
  freeaddrinfo(found);
  return connected;
}

bool is_unix_served(const std::string& path) {
  try {
    return bus::is_unix_served(path);
  } catch (const EnvironmentError&) {  // no path of a socket
    return false;
  }
}

}  // namespace

Address split(const std::string& url) {
  Address address;
  const size_t scheme_end = url.find("://");
  if (scheme_end == std::string::npos) return address;
  address.scheme = url.substr(0, scheme_end);
  if (address.scheme == "unix") {
    address.host = url.substr(scheme_end + 3);
    return address;
  }
  const size_t options = url.find('?');
  if (options != std::string::npos) address.options = url.substr(options);
  const std::string network =
      url.substr(scheme_end + 3, options == std::string::npos ? options : options - scheme_end - 3);
  const size_t colon = network.rfind(':');
  address.host = network.substr(0, colon);
  if (colon != std::string::npos) address.port = network.substr(colon + 1);
  const bool udpm = address.scheme == "udpm";
  if (address.host.empty()) address.host = udpm ? "239.255.76.67" : "127.0.0.1";
  if (address.port.empty()) address.port = udpm ? "7667" : "7700";
  return address;
}

std::string resolve_url(const std::string& url) {
  if (!url.empty()) return url;
  const char* named = std::getenv("LCM_DEFAULT_URL");
  if (named && *named) return named;
  // What `ruedo run` serves by itself: TCP where multicast has no route.
  return has_multicast_route() ? "udpm://239.255.76.67:7667?ttl=0" : "tcpq://127.0.0.1:7700";
}

bool has_multicast_route(const std::string& group) { return has_route(group, "7667"); }

bool is_served(const std::string& url) {
  const Address address = split(url);
  if (address.scheme == "unix") return is_unix_served(address.host);
  std::string why;
  return address.scheme != "tcpq" ||
         static_cast<bool>(bus::connect_tcp(address.host, address.port, why));
}

bool is_claimed(const std::string& url) {
  const Address address = split(url);
  if (address.scheme == "unix") return is_unix_served(address.host);
  const std::string claim = " @ruedo/" + address.scheme + "/" + address.host + ":" + address.port;
  std::ifstream sockets("/proc/net/unix");
  for (std::string line; std::getline(sockets, line);) {
    if (line.size() >= claim.size() &&
        line.compare(line.size() - claim.size(), claim.size(), claim) == 0)
      return true;
  }
  return false;
}

void check_reachable(const std::string& url) {
  const Address address = split(url);
  std::string why;
  if (address.scheme == "udpm") {
    if (has_multicast_route(address.host)) return;
    throw NoServer(url +
                   ": this machine has no route for multicast. On Linux: sudo ip route add "
                   "224.0.0.0/4 dev lo; "
                   "`ruedo doctor` tells more");
  }
  if (address.scheme == "tcpq") {
    if (bus::connect_tcp(address.host, address.port, why)) return;
    throw NoServer("no Ruedo server at " + url + " (" + why +
                   "). Is `ruedo run` started with this --lcm? `ruedo doctor` "
                   "looks for what is wrong");
  }
  if (address.scheme == "unix") {
    if (is_unix_served(address.host)) return;
    throw NoServer("no Ruedo server at " + url +
                   ". Is `ruedo run` started with this --lcm, by the same user?");
  }
  if (address.scheme == "memq" || address.scheme == "file") return;
  throw NoServer(url +
                 ": not an LCM URL; udpm://GROUP:PORT?ttl=0, tcpq://HOST:PORT or unix:///PATH is");
}

}  // namespace ruedo::client
