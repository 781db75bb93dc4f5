// On loopback, a request must name this machine by a loopback name, which stops pages elsewhere
// whose name was redirected here (DNS rebinding). On other addresses it needs the token. A page of
// another origin never gets a socket.
#include "http/guard.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <charconv>
#include <random>

#include <fmt/format.h>

#include "ruedo/errors.h"

namespace ruedo::http {
namespace {

[[noreturn]] void bad_address(const std::string& option, const std::string& text) {
  throw InputError(
      {},
      option + ": '" + text +
          "' is not allowed; an address is ADDRESS:PORT, such as 127.0.0.1:8080 or 0.0.0.0:8080");
}

// Empty if something other than a port follows it.
std::string_view host_name(std::string_view host) {
  const size_t colon = host.rfind(':');
  if (host.ends_with(']') || colon == std::string_view::npos) return host;
  const std::string_view port = host.substr(colon + 1);
  return port.find_first_not_of("0123456789") == std::string_view::npos ? host.substr(0, colon)
                                                                        : "";
}

bool equal(std::string_view a,
           std::string_view b) {  // constant time: reveals nothing about where they differ
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  return difference == 0;
}

}  // namespace

Address parse_address(const std::string& text, const std::string& option, int default_port) {
  Address address;
  address.port = default_port;
  if (text.empty()) return address;
  const size_t colon = text.rfind(':');
  std::string host = text.substr(0, colon),
              port = colon == std::string::npos ? "" : text.substr(colon + 1);
  if (colon == std::string::npos && text.find_first_not_of("0123456789") == std::string::npos) {
    host.clear();
    port = text;
  } else if (colon != std::string::npos && port.empty()) {
    bad_address(option, text);
  }
  if (!port.empty()) {
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), address.port);
    if (error != std::errc() || end != port.data() + port.size() || address.port < 0 ||
        address.port > 65535)
      bad_address(option, text);
  }
  if (host == "localhost") host = "127.0.0.1";
  if (!host.empty()) {
    in_addr parsed{};
    if (inet_pton(AF_INET, host.c_str(), &parsed) != 1) bad_address(option, text);
    address.host = host;
  }
  return address;
}

std::string make_token() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
}

std::string cookie_value(std::string_view cookies, std::string_view name) {
  while (!cookies.empty()) {
    const size_t end = std::min(cookies.find(';'), cookies.size());
    std::string_view cookie = cookies.substr(0, end);
    cookies.remove_prefix(std::min(end + 1, cookies.size()));
    while (cookie.starts_with(' ')) cookie.remove_prefix(1);
    if (cookie.starts_with(name) && cookie.substr(name.size()).starts_with('='))
      return std::string(cookie.substr(name.size() + 1));
  }
  return {};
}

std::string refuse(const Visit& visit, const Address& address, const std::string& token) {
  if (address.loopback()) {
    const std::string_view name = host_name(visit.host);
    in_addr parsed{};
    const bool is_loopback =
        name.starts_with("127.") && inet_pton(AF_INET, std::string(name).c_str(), &parsed) == 1;
    if (name != "localhost" && !is_loopback && name != "[::1]") {
      return "This console answers to localhost only. To reach it from elsewhere, start it with "
             "--view ADDRESS:PORT.";
    }
  }
  if (!token.empty() && !equal(visit.token, token) &&
      !equal(cookie_value(visit.cookie, "ruedo_token"), token)) {
    return "A token is needed: open the address that the server printed when it started.";
  }
  if (visit.socket && !visit.origin.empty() && visit.origin != "http://" + visit.host &&
      visit.origin != "https://" + visit.host) {
    return "A page of another origin may not steer this simulation.";
  }
  return {};
}

std::vector<std::string> reachable_hosts(const Address& address) {
  if (address.host != "0.0.0.0") return {address.host};
  std::vector<std::string> hosts;
  ifaddrs* interfaces = nullptr;
  if (getifaddrs(&interfaces) == 0) {
    for (const ifaddrs* i = interfaces; i; i = i->ifa_next) {
      if (!i->ifa_addr || i->ifa_addr->sa_family != AF_INET || (i->ifa_flags & IFF_UP) == 0)
        continue;
      char text[INET_ADDRSTRLEN];
      const auto* ipv4 = reinterpret_cast<const sockaddr_in*>(i->ifa_addr);
      if (inet_ntop(AF_INET, &ipv4->sin_addr, text, sizeof text)) hosts.emplace_back(text);
    }
    freeifaddrs(interfaces);
  }
  return hosts;
}

}  // namespace ruedo::http
