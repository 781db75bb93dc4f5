#include "bus/stream_socket.h"

#include <cerrno>
#include <cstring>

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/time.h>

namespace ruedo::bus {
namespace {

constexpr timeval kSendingPatience{5, 0};

}  // namespace

FileHandle stream_socket(int family) {
  FileHandle socket(::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0));
  ::setsockopt(socket.get(), SOL_SOCKET, SO_SNDTIMEO, &kSendingPatience, sizeof kSendingPatience);
  return socket;
}

FileHandle connect_tcp(const std::string& host, const std::string& port, std::string& why) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  if (const int error = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &found)) {
    why = ::gai_strerror(error);
    return FileHandle();
  }
  FileHandle socket = stream_socket(AF_INET);
  const bool connected = socket && ::connect(socket.get(), found->ai_addr, found->ai_addrlen) == 0;
  if (!connected) why = std::strerror(errno == EINPROGRESS ? ETIMEDOUT : errno);
  ::freeaddrinfo(found);
  if (!connected) return FileHandle();
  const int on = 1;
  ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return socket;
}

}  // namespace ruedo::bus
