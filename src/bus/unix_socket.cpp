#include "bus/unix_socket.h"

#include <cerrno>
#include <cstring>

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "bus/stream_socket.h"
#include "ruedo/errors.h"

namespace ruedo::bus {
namespace {

// A zero follows it, or what makes it a name of the thread's own: "~" and at most seven digits.
constexpr size_t kLongestPath = sizeof(sockaddr_un::sun_path) - 9;

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

void check_path(const std::string& path) {
  if (path.empty() || path[0] != '/' || path.size() > kLongestPath) {
    throw EnvironmentError("unix://" + path + ": a socket has an absolute path of at most " +
                           std::to_string(kLongestPath) + " bytes, such as unix:///tmp/ruedo.sock");
  }
}

// False: errno says why.
bool connect(const FileHandle& socket, const std::string& path) {
  check_path(path);
  const sockaddr_un address = address_of(path);
  return ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

[[noreturn]] void cannot_serve(const std::string& path) {
  throw EnvironmentError("cannot serve unix://" + path + " (" + std::strerror(errno) +
                         "): the folder must be there, and this user's to write");
}

// Removes what a server left behind that was killed.
void clear(const std::string& path) {
  struct stat status{};
  if (::lstat(path.c_str(), &status) != 0) return;
  if (!S_ISSOCK(status.st_mode))
    throw EnvironmentError("unix://" + path + " is a file, not a socket: choose another path");
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) cannot_serve(path);
}

// Gives what listens its name, unless another server has that.
void name(const std::string& listening, const std::string& path) {
  while (::link(listening.c_str(), path.c_str()) != 0) {
    if (errno != EEXIST) cannot_serve(path);
    if (is_unix_served(path))
      throw EnvironmentError("unix://" + path +
                             " is taken by another server: end that one, or take another path");
    clear(path);
  }
}

}  // namespace

FileHandle connect_unix(const std::string& path) {
  FileHandle socket = stream_socket(AF_UNIX);
  if (!connect(socket, path)) {
    throw EnvironmentError("nothing listens at unix://" + path + " (" + std::strerror(errno) +
                           "): start `ruedo run` with that --lcm first");
  }
  if (own_peer(socket.get()) < 0)
    throw EnvironmentError("unix://" + path + " is served by another user");
  return socket;
}

bool is_unix_served(const std::string& path) {
  const FileHandle socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  return connect(socket, path) || errno == EAGAIN;  // a server whose queue is full
}

FileHandle listen_unix(const std::string& path) {
  check_path(path);
  // It gets its name when it listens: a program that waits for the file may connect at once.
  const std::string own = path + "~" + std::to_string(::gettid());
  clear(own);
  struct Unnamed {
    const std::string& path;
    ~Unnamed() { ::unlink(path.c_str()); }
  } const unnamed{own};
  const sockaddr_un address = address_of(own);
  FileHandle socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  ::fchmod(socket.get(), 0600);  // before it can be seen
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::chmod(own.c_str(), 0600) != 0 || ::listen(socket.get(), 128) != 0)
    cannot_serve(path);
  name(own, path);
  return socket;
}

pid_t own_peer(int socket) {
  ucred peer{};
  socklen_t size = sizeof peer;
  const bool is_known = ::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0;
  return is_known && (peer.uid == ::geteuid() || peer.uid == 0) ? peer.pid : -1;
}

}  // namespace ruedo::bus
