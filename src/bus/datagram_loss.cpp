// The tables of the kernel: "RcvbufErrors" of the protocol, "drops" of each socket.
#include "bus/datagram_loss.h"

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <vector>

#include "bus/udp_sockets.h"

namespace ruedo::bus {
namespace {

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream in(line);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

int64_t number(const std::string& text) { return std::strtoll(text.c_str(), nullptr, 10); }

// "Udp: InDatagrams NoPorts ... RcvbufErrors ...", and below it the values.
int64_t receive_buffer_errors(const std::string& snmp) {
  std::istringstream in(snmp);
  std::vector<std::string> names;
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("Udp:")) continue;
    const std::vector<std::string> words = words_of(line);
    const auto name = std::find(names.begin(), names.end(), "RcvbufErrors") - names.begin();
    if (static_cast<size_t>(name) < std::min(names.size(), words.size()))
      return number(words[static_cast<size_t>(name)]);
    names = words;
  }
  return 0;
}

}  // namespace

DatagramLoss datagram_loss(const std::string& snmp, const std::string& udp, uint16_t port,
                           uint64_t own_inode) {
  DatagramLoss loss{receive_buffer_errors(snmp), 0};
  for (const UdpSocket& socket : udp_sockets(udp)) {
    if (socket.port == port && (own_inode == 0 || socket.inode != own_inode))
      loss.at_port += socket.drops;
  }
  return loss;
}

std::optional<DatagramLoss> datagram_loss(uint16_t port, uint64_t own_inode) {
  const auto snmp = text_of("/proc/net/snmp"), udp = text_of("/proc/net/udp");
  if (!snmp || !udp) return std::nullopt;
  return datagram_loss(*snmp, *udp, port, own_inode);
}

DatagramLossWatch::DatagramLossWatch(uint16_t port, int own_socket)
    : port_(port), own_inode_(inode_of(own_socket)) {
  look();
}

// A socket's own count would include datagrams that it filters, the machine's those of other ports.
int64_t DatagramLossWatch::look() {
  const auto now = datagram_loss(port_, own_inode_);
  int64_t lost = 0;
  if (now && last_) {
    lost = std::max<int64_t>(
        0, std::min(now->of_machine - last_->of_machine, now->at_port - last_->at_port));
  }
  last_ = now;
  return lost;
}

std::string cure_of_datagram_loss() {
  return "programs on this machine lose none with --lcm unix:///PATH or "
         "--lcm tcpq://127.0.0.1:7700; with multicast, larger buffers help: sudo sysctl -w "
         "net.core.rmem_max=2097152, and recv_buf_size=2097152 in the listeners' URL";
}

}  // namespace ruedo::bus
