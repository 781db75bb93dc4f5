// The kernel's tables, as they read, and sockets of this process.
#include "bus/udp_sockets.h"

#include <arpa/inet.h>
#include <sys/socket.h>

#include <gtest/gtest.h>

#include "system/file_handle.h"

namespace ruedo::bus {
namespace {

// 7667 is 0x1DF3; the columns "tr tm->when" and "tx_queue rx_queue" are one word each.
constexpr const char* kUdp =
    "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout "
    "inode ref pointer drops\n"
    "  10: 00000000:1DF3 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 "
    "501 2 0000000000000000 4\n";
constexpr const char* kUdp6 =
    "  sl  local_address                         remote_address                        st tx_queue "
    "rx_queue tr tm->when retrnsmt   uid  timeout inode ref pointer drops\n"
    " 11: 00000000000000000000000000000000:1DF4 00000000000000000000000000000000:0000 07 "
    "00000000:00000000 00:00000000 00000000     0        0 502 2 0000000000000000 20\n";

TEST(UdpSockets, AreReadFromTheKernelsTables) {
  for (const auto& [table, port, inode, drops] :
       {std::tuple(kUdp, 7667, 501u, 4), std::tuple(kUdp6, 7668, 502u, 20)}) {
    const std::vector<UdpSocket> sockets = udp_sockets(table);
    ASSERT_EQ(sockets.size(), 1u);
    EXPECT_EQ(sockets[0].port, port);
    EXPECT_EQ(sockets[0].inode, inode);
    EXPECT_EQ(sockets[0].drops, drops);
  }
  for (const char* text : {"", "\n\n", "heads\na b c\n", "heads\n 1: x 2 3 4 5 6 7 8 9 10 11 12\n"})
    EXPECT_TRUE(udp_sockets(text).empty()) << text;
}

FileHandle bound(int family, uint16_t port) {
  FileHandle socket(::socket(family, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in6 address{};  // of IPv4 the beginning
  address.sin6_family = static_cast<sa_family_t>(family);
  address.sin6_port = htons(port);
  const int on = 1;
  ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEPORT, &on, sizeof on);
  const socklen_t size = family == AF_INET ? sizeof(sockaddr_in) : sizeof address;
  if (::bind(socket.get(), reinterpret_cast<sockaddr*>(&address), size) != 0) return {};
  return socket;
}

uint16_t port_of(const FileHandle& socket) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  EXPECT_EQ(::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &size), 0);
  return ntohs(address.sin_port);
}

TEST(UdpSockets, ListenersAreAllButOurOwn) {
  const FileHandle own = bound(AF_INET, 0);
  ASSERT_TRUE(own);
  const uint16_t port = port_of(own);
  EXPECT_FALSE(has_listeners(port, inode_of(own.get())));
  for (const int family : {AF_INET, AF_INET6}) {
    const FileHandle other = bound(family, port);
    if (!other && family == AF_INET6) continue;  // a system without IPv6
    ASSERT_TRUE(other);
    EXPECT_TRUE(has_listeners(port, inode_of(own.get()))) << family;
  }
  EXPECT_FALSE(has_listeners(port, inode_of(own.get())));
}

TEST(UdpSockets, ThereMayBeListenersWhereTheSystemDoesNotListOurOwn) {
  constexpr uint16_t kNobodys = 1;
  EXPECT_TRUE(has_listeners(kNobodys, 12345));
}

}  // namespace
}  // namespace ruedo::bus
