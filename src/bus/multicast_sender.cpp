// The wire format is in multicast_receiver.cpp.
#include "bus/multicast_sender.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include "base/big_endian.h"

namespace ruedo::bus {
namespace {

constexpr uint32_t kShort = 0x4c433032, kFragment = 0x4c433033;
constexpr size_t kShortHead = 8, kFragmentHead = 20;
constexpr size_t kMostInDatagram = 64000;  // bytes of channel and data
constexpr size_t kMostFragments = 65535;   // their number has 16 bits

// The parts of a datagram.
template <typename... Parts>
void send_datagram(int socket, Parts... parts) {
  std::array<iovec, sizeof...(Parts)> pieces{parts...};
  msghdr message{};
  message.msg_iov = pieces.data();
  message.msg_iovlen = pieces.size();
  while (::sendmsg(socket, &message, MSG_NOSIGNAL) < 0 && errno == EINTR) {
  }
}

iovec piece(const void* bytes, size_t size) { return {const_cast<void*>(bytes), size}; }

}  // namespace

MulticastSender::MulticastSender(const std::string& group, uint16_t port, int ttl)
    : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  const auto check = [](bool good, const char* what) {
    if (!good) throw std::system_error(errno, std::generic_category(), what);
  };
  check(static_cast<bool>(socket_), "socket");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  check(::inet_pton(AF_INET, group.c_str(), &address.sin_addr) == 1, "inet_pton");
  const auto hops = static_cast<uint8_t>(std::clamp(ttl, 0, 255));
  check(::setsockopt(socket_.get(), IPPROTO_IP, IP_MULTICAST_TTL, &hops, sizeof hops) == 0, "TTL");
  check(::connect(socket_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0,
        "connect");
}

void MulticastSender::send(const std::string& channel, const uint8_t* bytes, size_t size) {
  const std::lock_guard lock(mutex_);
  const uint32_t sequence = sequence_++;
  const iovec name = piece(channel.c_str(), channel.size() + 1);
  if (name.iov_len + size <= kMostInDatagram) {
    std::array<uint8_t, kShortHead> head{};
    write_big_endian(head.data(), kShort);
    write_big_endian(head.data() + 4, sequence);
    return send_datagram(socket_.get(), piece(head.data(), head.size()), name, piece(bytes, size));
  }
  // The first fragment has the name beside its data.
  const size_t count = (name.iov_len + size + kMostInDatagram - 1) / kMostInDatagram;
  if (count > kMostFragments) return;
  for (size_t number = 0, offset = 0; number < count; ++number) {
    const iovec shown = number == 0 ? name : iovec{};
    const size_t length = std::min(kMostInDatagram - shown.iov_len, size - offset);
    std::array<uint8_t, kFragmentHead> head{};
    write_big_endian(head.data(), kFragment);
    write_big_endian(head.data() + 4, sequence);
    write_big_endian(head.data() + 8, static_cast<uint32_t>(size));
    write_big_endian(head.data() + 12, static_cast<uint32_t>(offset));
    write_big_endian(head.data() + 16, static_cast<uint16_t>(number));
    write_big_endian(head.data() + 18, static_cast<uint16_t>(count));
    send_datagram(socket_.get(), piece(head.data(), head.size()), shown,
                  piece(bytes + offset, length));
    offset += length;
  }
}

}  // namespace ruedo::bus
