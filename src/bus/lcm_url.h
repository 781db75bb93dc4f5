// LCM's addresses: taken apart, and checked against this machine before LCM itself tries (and waits
// ten seconds).
#pragma once

#include <cstdint>
#include <string>

namespace ruedo::bus {

inline constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";
inline constexpr uint16_t kDefaultTcpPort = 7700;  // LCM's

struct LcmUrl {
  std::string scheme;  // "udpm", "memq", "tcpq"; "unix", which LCM does not have
  std::string host;    // udpm: the multicast group; tcpq: an IPv4 address; unix: the socket's path
  uint16_t port = 0;
  std::string options;  // "ttl=0&recv_buf_size=2097152"

  // As LCM takes it.
  std::string str() const;
  // One of the options, or `fallback`.
  std::string option(const std::string& key, const std::string& fallback) const;
};

// Reads an address; "" is $LCM_DEFAULT_URL, or kDefaultUrl. A udpm address without a ttl gets ttl
// 0, so that nothing leaves the machine by default; a tcpq address without host and port gets
// LCM's, 127.0.0.1:7700. Throws InputError for anything else, with the source of the text.
LcmUrl parse_url(const std::string& text, const std::string& given_by = "--lcm");

// True when this machine has a way to a udpm address's group. Takes microseconds, as the next.
bool has_route(const LcmUrl& url);

// Throws EnvironmentError, with the cure, when this machine has no way to the multicast group.
void check_route(const LcmUrl& url);

// True when a server listens at a tcpq address.
bool is_served(const LcmUrl& url, int timeout_ms);

// True when a datagram sent to the group comes back within `timeout_ms`: route, loopback and
// firewall together.
bool hears_itself(const LcmUrl& url, int timeout_ms);

// Bytes that a socket's receive buffer may have at most here; -1 when not known.
int64_t receive_buffer_limit();

// Bytes of the receive buffer that an LCM program has with this address here; larger messages do
// not arrive. -1: no bound.
int64_t receive_buffer(const LcmUrl& url);

}  // namespace ruedo::bus
