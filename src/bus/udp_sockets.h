// The UDP sockets of this machine's network, as Linux lists them in /proc/net.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace ruedo::bus {

struct UdpSocket {
  uint16_t port;   // its own
  uint64_t inode;  // as fstat() says it
  int64_t drops;   // datagrams that it did not take
};

// From the text of /proc/net/udp or /proc/net/udp6.
std::vector<UdpSocket> udp_sockets(const std::string& table);

// A whole file of /proc/net; empty: it is not there.
std::optional<std::string> text_of(const std::string& file);

// 0: unknown.
uint64_t inode_of(int file);

// Whether some socket but our own receives what is sent to that port on this machine: without one,
// a datagram with a TTL of 0 reaches no program. True where the system does not list even our own.
// Programs that watch the network itself (tcpdump) are not seen.
bool has_listeners(uint16_t port, uint64_t own_inode);

}  // namespace ruedo::bus
