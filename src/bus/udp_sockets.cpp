// A line for each socket; its columns are separated by blanks.
#include "bus/udp_sockets.h"

#include <cstdlib>
#include <fstream>
#include <sstream>

#include <sys/stat.h>

namespace ruedo::bus {

std::optional<std::string> text_of(const std::string& file) {
  std::ifstream in(file);
  if (!in) return std::nullopt;
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::vector<UdpSocket> udp_sockets(const std::string& table) {
  constexpr size_t kLocal = 1, kInode = 9, kDrops = 12;  // columns
  std::vector<UdpSocket> sockets;
  std::istringstream in(table);
  std::string line;
  std::getline(in, line);  // the heads
  while (std::getline(in, line)) {
    std::istringstream words_in(line);
    std::vector<std::string> words;
    for (std::string word; words_in >> word;) words.push_back(word);
    if (words.size() <= kDrops) continue;
    const size_t colon = words[kLocal].find(':');
    if (colon == std::string::npos) continue;
    sockets.push_back(
        {static_cast<uint16_t>(std::strtoul(words[kLocal].c_str() + colon + 1, nullptr, 16)),
         std::strtoull(words[kInode].c_str(), nullptr, 10),
         std::strtoll(words[kDrops].c_str(), nullptr, 10)});
  }
  return sockets;
}

uint64_t inode_of(int file) {
  struct stat status{};
  return ::fstat(file, &status) == 0 ? status.st_ino : 0;
}

bool has_listeners(uint16_t port, uint64_t own_inode) {
  bool own_is_listed = false;
  for (const char* file : {"/proc/net/udp", "/proc/net/udp6"}) {  // Java's sockets are of IPv6
    for (const UdpSocket& socket : udp_sockets(text_of(file).value_or(""))) {
      if (socket.port != port) continue;
      if (socket.inode != own_inode) return true;
      own_is_listed = true;
    }
  }
  return !own_is_listed;  // a sandbox may show an empty table
}

}  // namespace ruedo::bus
