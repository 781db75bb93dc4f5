// Datagrams that the kernel threw away because a program's receive buffer was full: LCM's multicast
// says nothing of them. Linux counts them, in /proc/net.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace ruedo::bus {

struct DatagramLoss {
  int64_t of_machine = 0;  // at full receive buffers, since this network began; of all programs
  int64_t at_port = 0;     // of sockets on the port that are there now, whatever the reason: what
                           // they themselves filter is in it
};

// From the texts of /proc/net/snmp and /proc/net/udp. own_inode: of a socket that is left out; 0:
// none.
DatagramLoss datagram_loss(const std::string& snmp, const std::string& udp, uint16_t port,
                           uint64_t own_inode = 0);

// The system's current counts; empty if it has none.
std::optional<DatagramLoss> datagram_loss(uint16_t port, uint64_t own_inode = 0);

// Losses since the last call.
class DatagramLossWatch {
 public:
  // own_socket: its losses are not counted; it may filter. The first look comes at once.
  DatagramLossWatch(uint16_t port, int own_socket);

  // How many datagrams programs on this machine have lost at the port since the last look.
  int64_t look();

 private:
  uint16_t port_;
  uint64_t own_inode_;
  std::optional<DatagramLoss> last_;
};

// The advice for the user.
std::string cure_of_datagram_loss();

}  // namespace ruedo::bus
