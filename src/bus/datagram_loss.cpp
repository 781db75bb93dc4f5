// The tables of the kernel: "RcvbufErrors" of the protocol, "drops" of each socket.
#include "bus/datagram_loss.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <vector>

#include <sys/stat.h>

namespace ruedo::bus {
namespace {

std::optional<std::string> text_of(const char* file) {
  std::ifstream in(file);
  if (!in) return std::nullopt;
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream in(line);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

int64_t number(const std::string& text, int base = 10) {
  return std::strtoll(text.c_str(), nullptr, base);
}

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
  std::istringstream in(udp);
  std::string line;
  std::getline(in, line);  // the heads
  while (std::getline(in, line)) {
    constexpr size_t kLocal = 1, kInode = 9, kDrops = 12;  // columns
    const std::vector<std::string> words = words_of(line);
    if (words.size() <= kDrops) continue;
    const size_t colon = words[kLocal].find(':');
    if (colon == std::string::npos || number(words[kLocal].substr(colon + 1), 16) != port) continue;
    if (own_inode != 0 && static_cast<uint64_t>(number(words[kInode])) == own_inode) continue;
    loss.at_port += number(words[kDrops]);
  }
  return loss;
}

std::optional<DatagramLoss> datagram_loss(uint16_t port, uint64_t own_inode) {
  const auto snmp = text_of("/proc/net/snmp"), udp = text_of("/proc/net/udp");
  if (!snmp || !udp) return std::nullopt;
  return datagram_loss(*snmp, *udp, port, own_inode);
}

DatagramLossWatch::DatagramLossWatch(uint16_t port, int own_socket) : port_(port), own_inode_(0) {
  struct stat status{};
  if (::fstat(own_socket, &status) == 0) own_inode_ = status.st_ino;
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
