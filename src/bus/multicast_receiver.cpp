// LCM's multicast on the wire. All numbers are big endian.
//
//   short:    magic, sequence, channel and a 0, data
//   fragment: magic, sequence, size of the message, offset, number of the fragment (16 bits), of
//   how many; the first has
//             channel and a 0 before its data
#include "bus/multicast_receiver.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include <arpa/inet.h>
#include <linux/filter.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "base/big_endian.h"

namespace ruedo::bus {
namespace {

constexpr uint32_t kShort = 0x4c433032, kFragment = 0x4c433033;
constexpr size_t kShortHead = 8, kFragmentHead = 20, kLargestDatagram = 65536;
constexpr size_t kFragmentMemory = 128;  // beside its data

// The channel's name at the beginning of `bytes`; size() + 1 of them are its. Empty: no channel.
std::string_view channel_at(const uint8_t* bytes, size_t size) {
  const auto* end = static_cast<const uint8_t*>(
      std::memchr(bytes, 0, std::min(size, MulticastReceiver::kLongestChannel + 1)));
  return end ? std::string_view(reinterpret_cast<const char*>(bytes),
                                static_cast<size_t>(end - bytes))
             : std::string_view();
}

}  // namespace

MulticastReceiver::MulticastReceiver(const std::string& group, uint16_t port, int buffer)
    : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)), datagram_(kLargestDatagram) {
  const auto check = [](bool good, const char* what) {
    if (!good) throw std::system_error(errno, std::generic_category(), what);
  };
  check(static_cast<bool>(socket_), "socket");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  check(::inet_pton(AF_INET, group.c_str(), &address.sin_addr) == 1, "inet_pton");
  const int on = 1;
  check(::setsockopt(socket_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0, "SO_REUSEADDR");
  check(::setsockopt(socket_.get(), SOL_SOCKET, SO_REUSEPORT, &on, sizeof on) == 0, "SO_REUSEPORT");
  // The system gives at most its own limit.
  if (buffer > 0) ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer);
  check(::bind(socket_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0, "bind");
  ip_mreq membership{};
  membership.imr_multiaddr = address.sin_addr;
  membership.imr_interface.s_addr = htonl(INADDR_ANY);
  check(::setsockopt(socket_.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership,
                     sizeof membership) == 0,
        "IP_ADD_MEMBERSHIP");
}

bool MulticastReceiver::receive(const Handler& handler) {
  sockaddr_in from{};
  socklen_t from_size = sizeof from;
  const ssize_t got = ::recvfrom(socket_.get(), datagram_.data(), datagram_.size(), MSG_DONTWAIT,
                                 reinterpret_cast<sockaddr*>(&from), &from_size);
  if (got < 0) return false;
  read(datagram_.data(), static_cast<size_t>(got),
       {ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)}, handler);
  return true;
}

void MulticastReceiver::read(const uint8_t* bytes, size_t size, Sender sender,
                             const Handler& handler) {
  sender_ = sender;
  if (size <= kShortHead) return;
  const uint32_t magic = read_big_endian<uint32_t>(bytes);
  if (magic == kFragment) return take_fragment(bytes, size, handler);
  if (magic != kShort) return;
  const std::string_view channel = channel_at(bytes + kShortHead, size - kShortHead);
  const size_t head = kShortHead + channel.size() + 1;
  if (!channel.empty()) handler(channel, bytes + head, size - head);
}

void MulticastReceiver::take_fragment(const uint8_t* bytes, size_t size, const Handler& handler) {
  if (size <= kFragmentHead) return;
  const size_t total = read_big_endian<uint32_t>(bytes + 8),
               offset = read_big_endian<uint32_t>(bytes + 12),
               number = read_big_endian<uint16_t>(bytes + 16),
               of = read_big_endian<uint16_t>(bytes + 18);
  const uint8_t* data = bytes + kFragmentHead;
  size_t length = size - kFragmentHead;
  std::string_view channel;
  if (number == 0) {
    channel = channel_at(data, length);
    if (channel.empty()) return;
    data += channel.size() + 1;
    length -= channel.size() + 1;
  }
  if (number >= of || total > kLongestMessage || offset > total || length > total - offset) return;
  const auto partial = partial_of(read_big_endian<uint32_t>(bytes + 4), total, of);
  if (partial == partials_.end()) return;
  const auto [fragment, is_new] = partial->fragments.try_emplace(number);
  if (!is_new) return;
  fragment->second = {offset, {data, data + length}};
  partial->memory += length + kFragmentMemory;
  partial_memory_ += length + kFragmentMemory;
  if (number == 0) partial->channel = channel;
  if (partial->fragments.size() == of) {
    const Partial complete = std::move(*partial);
    partial_memory_ -= complete.memory;
    partials_.erase(partial);
    if (const auto message = joined(complete.fragments, total))
      handler(complete.channel, message->data(), message->size());
  }
  while (partial_memory_ > kMostPartial) forget(partials_.begin());
}

// end(): a fragment contradicts those before it.
MulticastReceiver::Partials::iterator MulticastReceiver::partial_of(uint32_t sequence, size_t size,
                                                                    size_t count) {
  const auto is_senders = [this](const Partial& one) { return one.sender == sender_; };
  const auto known = std::find_if(partials_.begin(), partials_.end(), [&](const Partial& one) {
    return is_senders(one) && one.sequence == sequence;
  });
  if (known != partials_.end())
    return known->size == size && known->count == count ? known : partials_.end();
  if (std::count_if(partials_.begin(), partials_.end(), is_senders) >=
      std::ptrdiff_t{kMostOfSender})
    forget(std::find_if(partials_.begin(), partials_.end(), is_senders));
  if (partials_.size() >= kMostMessages) forget(partials_.begin());
  Partial& made = partials_.emplace_back();
  made.sender = sender_;
  made.sequence = sequence;
  made.size = size;
  made.count = count;
  return std::prev(partials_.end());
}

void MulticastReceiver::forget(Partials::iterator partial) {
  partial_memory_ -= partial->memory;
  partials_.erase(partial);
}

// Empty unless they follow each other without a gap.
std::optional<std::vector<uint8_t>> MulticastReceiver::joined(
    const std::map<size_t, Fragment>& fragments, size_t size) {
  std::vector<uint8_t> message;
  message.reserve(size);
  for (const auto& [number, fragment] : fragments) {
    if (fragment.offset != message.size()) return std::nullopt;
    message.insert(message.end(), fragment.data.begin(), fragment.data.end());
  }
  if (message.size() != size) return std::nullopt;
  return message;
}

// A filter in the kernel (BPF), which sees the datagram from its UDP header on.
bool MulticastReceiver::ignore(Sender sender) {
  sock_filter code[] = {
      {BPF_LD | BPF_H | BPF_ABS, 0, 0, 0},
      {BPF_JMP | BPF_JEQ | BPF_K, 0, 3, sender.port},
      {BPF_LD | BPF_W | BPF_ABS, 0, 0, static_cast<uint32_t>(SKF_NET_OFF) + 12},
      {BPF_JMP | BPF_JEQ | BPF_K, 0, 1, sender.address},
      {BPF_RET | BPF_K, 0, 0, 0},
      {BPF_RET | BPF_K, 0, 0, 0xffffffff},
  };
  const sock_fprog program{static_cast<unsigned short>(std::size(code)), code};
  return ::setsockopt(socket_.get(), SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) == 0;
}

}  // namespace ruedo::bus
