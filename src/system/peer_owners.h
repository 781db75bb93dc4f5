// Who owns the other end of a TCP connection: a process of this machine, by its number, or another
// machine, by its address.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

namespace ruedo {

class PeerOwners {
 public:
  // Looks through the system's list of connections to this port, and its processes' files: takes
  // milliseconds.
  explicit PeerOwners(uint16_t server_port);

  // Of the peer of a connected socket. Processes of other users cannot be looked into: all of a
  // user's are one.
  std::string owner_of(int socket) const;

 private:
  std::unordered_map<uint16_t, std::string> by_port_;  // of the peer
};

// Chooses which of a server's connected sockets, oldest first, to close so that `most` are left:
// always the newest of the owner with most of them.
std::vector<size_t> who_give_way(std::span<const int> sockets, size_t most, uint16_t server_port);

}  // namespace ruedo
