// LCM URLs.
#include "transport/address.h"

#include <cstdlib>
#include <fstream>

#include "bus/stream_socket.h"
#include "bus/unix_socket.h"
#include "ruedo/client.h"
#include "ruedo/errors.h"

namespace ruedo::client {
namespace {

bool is_unix_served(const std::string& path) {
  try {
    return bus::is_unix_served(path);
  } catch (const EnvironmentError&) {  // no path of a socket
    return false;
  }
}

}  // namespace

bus::LcmUrl read_address(const std::string& url) {
  try {
    bus::LcmUrl address = bus::parse_url(url, "url");
    if (address.scheme != "memq") return address;
    throw NoServer("url '" + url + "': no client reaches a server whose --lcm is memq://");
  } catch (const InputError& error) {
    throw NoServer(error.what());
  }
}

std::string resolve_url(const std::string& url) {
  if (!url.empty()) return url;
  const char* named = std::getenv("LCM_DEFAULT_URL");
  if (named && *named) return named;
  // The default address of `ruedo run`: TCP where multicast has no route.
  return has_multicast_route() ? bus::kDefaultUrl : "tcpq://127.0.0.1:7700";
}

bool has_multicast_route() { return bus::has_route(bus::parse_url(bus::kDefaultUrl)); }

bool is_served(const std::string& url) {
  const bus::LcmUrl address = read_address(url);
  if (address.scheme == "unix") return is_unix_served(address.host);
  std::string why;
  return address.scheme != "tcpq" ||
         static_cast<bool>(bus::connect_tcp(address.host, std::to_string(address.port), why));
}

bool is_claimed(const std::string& url) {
  const bus::LcmUrl address = read_address(url);
  if (address.scheme == "unix") return is_unix_served(address.host);
  const std::string claim =
      " @ruedo/" + address.scheme + "/" + address.host + ":" + std::to_string(address.port);
  std::ifstream sockets("/proc/net/unix");
  for (std::string line; std::getline(sockets, line);) {
    if (line.size() >= claim.size() &&
        line.compare(line.size() - claim.size(), claim.size(), claim) == 0)
      return true;
  }
  return false;
}

void check_reachable(const std::string& url) {
  const bus::LcmUrl address = read_address(url);
  std::string why;
  if (address.scheme == "udpm") {
    if (bus::has_route(address)) return;
    throw NoServer(url +
                   ": this machine has no route for multicast. On Linux: sudo ip route add "
                   "224.0.0.0/4 dev lo; "
                   "`ruedo doctor` explains");
  }
  if (address.scheme == "tcpq") {
    if (bus::connect_tcp(address.host, std::to_string(address.port), why)) return;
    throw NoServer("no Ruedo server at " + url + " (" + why +
                   "). Is `ruedo run` started with this --lcm? `ruedo doctor` "
                   "looks for what is wrong");
  }
  if (address.scheme == "unix") {
    if (is_unix_served(address.host)) return;
    throw NoServer("no Ruedo server at " + url +
                   ". Is `ruedo run` started with this --lcm, by the same user?");
  }
}

}  // namespace ruedo::client
