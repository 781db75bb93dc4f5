// From /proc: /proc/net/tcp has each connection's inode and user, /proc/PID/fd the inodes that a
// process holds.
#include "system/peer_owners.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <tuple>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace fs = std::filesystem;

namespace ruedo {
namespace {

// "0100007F:1E14": the address as the machine keeps it, the port.
bool read_port(const std::string& text, uint16_t& port) {
  const size_t colon = text.find(':');
  if (colon == std::string::npos) return false;
  port = static_cast<uint16_t>(std::strtoul(text.c_str() + colon + 1, nullptr, 16));
  return true;
}

}  // namespace

PeerOwners::PeerOwners(uint16_t server_port) {
  std::unordered_map<std::string, uint16_t> port_of;  // "socket:[INODE]" to the peer's port
  std::ifstream connections("/proc/net/tcp");
  std::string line;
  for (std::getline(connections, line); std::getline(connections, line);) {
    std::istringstream words(line);
    std::string number, local, remote, state, queues, timer, retries, user, timeout, inode;
    words >> number >> local >> remote >> state >> queues >> timer >> retries >> user >> timeout >>
        inode;
    uint16_t local_port = 0, remote_port = 0;
    if (!read_port(local, local_port) || !read_port(remote, remote_port) ||
        remote_port != server_port)
      continue;
    by_port_[local_port] = "user " + user;
    port_of["socket:[" + inode + "]"] = local_port;
  }
  std::error_code error;
  for (const fs::directory_entry& process : fs::directory_iterator("/proc", error)) {
    const std::string number = process.path().filename().string();
    if (number.empty() || std::isdigit(static_cast<unsigned char>(number[0])) == 0) continue;
    std::error_code gone;
    for (auto file = fs::directory_iterator(process.path() / "fd", gone);
         !gone && file != fs::directory_iterator(); file.increment(gone)) {
      std::error_code unreadable;
      const auto found = port_of.find(fs::read_symlink(file->path(), unreadable).string());
      if (!unreadable && found != port_of.end()) by_port_[found->second] = "process " + number;
    }
  }
}

std::string PeerOwners::owner_of(int socket) const {
  sockaddr_in peer{};
  socklen_t size = sizeof peer;
  if (::getpeername(socket, reinterpret_cast<sockaddr*>(&peer), &size) != 0) return "";
  char address[INET_ADDRSTRLEN] = "";
  ::inet_ntop(AF_INET, &peer.sin_addr, address, sizeof address);
  const auto found = by_port_.find(ntohs(peer.sin_port));
  return found == by_port_.end() ? std::string("address ") + address : found->second;
}

std::vector<size_t> who_give_way(std::span<const int> sockets, size_t most, uint16_t server_port) {
  const PeerOwners owners(server_port);
  std::map<std::string, std::vector<size_t>> shares;
  for (size_t i = 0; i < sockets.size(); ++i) shares[owners.owner_of(sockets[i])].push_back(i);
  std::vector<size_t> giving;
  while (sockets.size() - giving.size() > most) {
    std::vector<size_t>& largest =
        std::max_element(shares.begin(), shares.end(), [](const auto& a, const auto& b) {
          return std::tuple(a.second.size(), a.second.back()) <
                 std::tuple(b.second.size(), b.second.back());
        })->second;
    giving.push_back(largest.back());
    largest.pop_back();
    std::erase_if(shares, [](const auto& share) { return share.second.empty(); });
  }
  return giving;
}

}  // namespace ruedo
