// Choosing, claiming and opening a server's address.
#include "bus/server_bus.h"

#include <cstdlib>

#include <netinet/in.h>
#include <sys/socket.h>

#include "bus/lcm_bus.h"
#include "bus/rival_watch.h"
#include "bus/tcpq_server.h"
#include "bus/unix_server.h"
#include "ruedo/errors.h"

namespace ruedo::bus {
namespace {

constexpr int kTries = 100;

FileHandle bound(int type, in_addr_t host, uint16_t port) {
  FileHandle socket(::socket(AF_INET, type | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(host);
  return ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0
             ? std::move(socket)
             : FileHandle();
}

uint16_t port_of(const FileHandle& socket) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  ::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

std::string line_about(const std::string& world) {
  return "pid " + std::to_string(::getpid()) + ", world " + world;
}

std::unique_ptr<Bus> lcm_bus(const LcmUrl& url) {
  auto bus = std::make_unique<LcmBus>(url.str());
  bus->send_to_listeners_only();
  return bus;
}

// A multicast port that nothing on this machine uses, with a TCP socket on the same port as the
// token of it.
ServerBus on_free_multicast_port(const std::string& world) {
  for (int i = 0; i < kTries; ++i) {
    ServerBus made;
    made.token = bound(SOCK_STREAM, INADDR_LOOPBACK, 0);
    if (!made.token) break;
    made.url = parse_url(kDefaultUrl);
    made.url.port = port_of(made.token);
    if (!bound(SOCK_DGRAM, INADDR_ANY, made.url.port)) continue;  // some LCM program uses it
    if (!claimed_by(made.url).empty()) continue;
    made.claim = std::make_unique<UrlClaim>(made.url, line_about(world));
    made.bus = lcm_bus(made.url);
    return made;
  }
  throw EnvironmentError("--lcm auto: no free port was found");
}

ServerBus on_free_tcp_port(const std::string& world) {
  ServerBus made;
  made.url = {"tcpq", "127.0.0.1", 0, ""};
  auto server = std::make_unique<TcpqServer>(made.url);
  made.url.port = server->port();
  made.claim = std::make_unique<UrlClaim>(made.url, line_about(world));
  made.bus = std::move(server);
  return made;
}

}  // namespace

namespace {

ServerBus unwatched_bus(const std::string& text, const std::string& world) {
  const char* environment = std::getenv("LCM_DEFAULT_URL");
  const bool asked = !text.empty() || (environment && *environment);
  const bool routed = has_route(parse_url(kDefaultUrl));
  if (text == "auto" || text == "auto-tcp") {
    ServerBus made =
        routed && text == "auto" ? on_free_multicast_port(world) : on_free_tcp_port(world);
    made.announce = true;
    return made;
  }
  ServerBus made;
  if (!asked && !routed) {
    made.url = parse_url("tcpq://");
    made.announce = true;
    made.note =
        "no multicast route here, so this server speaks LCM over TCP (`ruedo doctor` explains)";
  } else {
    made.url = parse_url(text);
  }
  check_route(made.url);
  made.claim = std::make_unique<UrlClaim>(made.url, line_about(world));
  if (made.url.scheme == "tcpq") {
    made.bus = std::make_unique<TcpqServer>(made.url);
  } else if (made.url.scheme == "unix") {
    made.bus = std::make_unique<UnixServer>(made.url);
  } else {
    made.bus = lcm_bus(made.url);
  }
  return made;
}

}  // namespace

ServerBus open_server_bus(const std::string& text, const std::string& world,
                          std::function<void(const std::string&)> say) {
  ServerBus made = unwatched_bus(text, world);
  if (made.url.scheme != "memq")  // which no other process can share
    made.bus = std::make_unique<RivalWatch>(std::move(made.bus), std::move(say));
  return made;
}

std::string export_line(const LcmUrl& url) { return "export LCM_DEFAULT_URL='" + url.str() + "'"; }

}  // namespace ruedo::bus
