// The kernel's tables, as they read; and a socket that really loses datagrams.
#include "bus/datagram_loss.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace ruedo::bus {
namespace {

constexpr const char* kSnmp =
    "Ip: Forwarding DefaultTTL\n"
    "Ip: 1 64\n"
    "Udp: InDatagrams NoPorts InErrors OutDatagrams RcvbufErrors SndbufErrors\n"
    "Udp: 100 1 9 120 7 0\n"
    "UdpLite: InDatagrams NoPorts InErrors OutDatagrams RcvbufErrors SndbufErrors\n"
    "UdpLite: 0 0 0 0 3 0\n";
// 7667 is 0x1DF3; the columns "tr tm->when" and "tx_queue rx_queue" are one word each.
constexpr const char* kUdp =
    "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout "
    "inode ref pointer drops\n"
    "  10: 00000000:1DF3 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 "
    "501 2 0000000000000000 4\n"
    "  11: 0100007F:1DF3 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 "
    "502 2 0000000000000000 20\n"
    "  12: 00000000:1DF4 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 "
    "503 2 0000000000000000 300\n";

TEST(DatagramLoss, IsReadFromTheKernelsTables) {
  EXPECT_EQ(datagram_loss(kSnmp, kUdp, 7667).of_machine, 7);
  EXPECT_EQ(datagram_loss(kSnmp, kUdp, 7667).at_port, 24);
  EXPECT_EQ(datagram_loss(kSnmp, kUdp, 7667, 502).at_port, 4);
  EXPECT_EQ(datagram_loss(kSnmp, kUdp, 7668).at_port, 300);
  EXPECT_EQ(datagram_loss(kSnmp, kUdp, 1).at_port, 0);
  for (const char* text : {"", "\n\n", "Udp:\nUdp:\n", "Udp: RcvbufErrors\n", "a b c"}) {
    EXPECT_EQ(datagram_loss(text, text, 7667).of_machine, 0);
    EXPECT_EQ(datagram_loss(text, text, 7667).at_port, 0);
  }
}

struct Socket {
  int file = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  Socket() {
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(file, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(::getsockname(file, reinterpret_cast<sockaddr*>(&address), &size), 0);
  }
  ~Socket() { ::close(file); }
  uint16_t port() const { return ntohs(address.sin_port); }
};

// A datagram that was sent and does not arrive was lost: on loopback only the socket can lose it.
TEST(DatagramLoss, CountsDatagramsThatAListenerMissed) {
  constexpr int kSent = 200;
  const Socket listener, sender;
  const int smallest = 1;
  ::setsockopt(listener.file, SOL_SOCKET, SO_RCVBUF, &smallest, sizeof smallest);
  DatagramLossWatch watch(listener.port(), sender.file), own(listener.port(), listener.file);
  EXPECT_EQ(watch.look(), 0);
  const char bytes[1000]{};
  for (int i = 0; i < kSent; ++i) {
    ASSERT_EQ(::sendto(sender.file, bytes, sizeof bytes, 0,
                       reinterpret_cast<const sockaddr*>(&listener.address), sizeof(sockaddr_in)),
              static_cast<ssize_t>(sizeof bytes));
  }
  int came = 0;
  char taken[1000];
  while (::recv(listener.file, taken, sizeof taken, MSG_DONTWAIT) > 0) ++came;
  ASSERT_LT(came, kSent);
  EXPECT_EQ(watch.look(), kSent - came);
  EXPECT_EQ(watch.look(), 0);
  EXPECT_EQ(own.look(), 0);
}

}  // namespace
}  // namespace ruedo::bus
