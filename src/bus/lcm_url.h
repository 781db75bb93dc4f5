// LCM's addresses: taken apart, and checked against this machine before LCM itself tries (and waits ten seconds).
#pragma once

#include <cstdint>
#include <string>

namespace ruedo::bus {

inline constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";

struct LcmUrl {
  std::string scheme;              // "udpm", "memq", "tcpq", ...
  std::string host;                // udpm: the multicast group
  uint16_t port = 0;
  std::string options;             // "ttl=0&recv_buf_size=2097152"

  // As LCM takes it.
  std::string str() const;
  // One of the options, or `fallback`.
  std::string option(const std::string& key, const std::string& fallback) const;
};

// Reads an address; "" is $LCM_DEFAULT_URL, or kDefaultUrl. A udpm address without a ttl gets ttl 0: nothing leaves the
// machine unless it is asked to. Throws InputError for what is none.
LcmUrl parse_url(const std::string& text);

// Throws EnvironmentError, with the cure, when this machine has no way to the multicast group. Takes microseconds.
void check_route(const LcmUrl& url);

// True when a datagram sent to the group comes back within `timeout_ms`: route, loopback and firewall together.
bool hears_itself(const LcmUrl& url, int timeout_ms);

// Bytes that a socket's receive buffer may have at most here; -1 when not known.
int64_t receive_buffer_limit();

}  // namespace ruedo::bus
