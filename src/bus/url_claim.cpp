// Claims by abstract local sockets: a connection reads a line.
#include "bus/url_claim.h"

#include <cerrno>
#include <cstddef>
#include <cstring>

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>

#include "bus/unix_socket.h"
#include "ruedo/errors.h"

namespace ruedo::bus {
namespace {

constexpr int kAnswerMs = 300;
constexpr size_t kLongestLine = 400;

struct Name {
  sockaddr_un address{};
  socklen_t size;
};

Name name_of(const LcmUrl& url) {
  Name name;
  const std::string text = "ruedo/" + url.scheme + "/" + url.host + ":" + std::to_string(url.port);
  name.address.sun_family = AF_UNIX;
  const size_t length = std::min(text.size(), sizeof name.address.sun_path - 1);
  std::memcpy(name.address.sun_path + 1, text.data(), length);  // a zero first: abstract
  name.size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length);
  return name;
}

FileHandle local_socket(int more) {
  return FileHandle(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | more, 0));
}

}  // namespace

UrlClaim::UrlClaim(const LcmUrl& url, std::string owner) : owner_(std::move(owner)) {
  if (url.scheme == "memq" || url.scheme == "unix") return;  // a socket is its own claim
  const Name name = name_of(url);
  socket_ = local_socket(SOCK_NONBLOCK);
  if (::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&name.address), name.size) != 0 ||
      ::listen(socket_.get(), 16) != 0) {
    const std::string other = errno == EADDRINUSE ? claimed_by(url) : std::strerror(errno);
    throw EnvironmentError(url.str() + " is taken by another server: " + other +
                           ". End that one, or take another port: `--lcm auto` finds a free one");
  }
  stop_ = FileHandle(::eventfd(0, EFD_CLOEXEC));
  thread_ = std::thread([this] { answer(); });
}

UrlClaim::~UrlClaim() {
  if (!thread_.joinable()) return;
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(stop_.get(), &one, sizeof one);
  thread_.join();
}

void UrlClaim::describe(std::string owner) {
  std::lock_guard lock(mutex_);
  owner_ = std::move(owner);
}

void UrlClaim::answer() {
  for (;;) {
    pollfd waiting[2] = {{socket_.get(), POLLIN, 0}, {stop_.get(), POLLIN, 0}};
    if (::poll(waiting, 2, -1) < 0) {
      if (errno == EINTR) continue;
      return;  // the socket holds the claim without a word
    }
    if (waiting[1].revents != 0) return;
    const FileHandle asker(
        ::accept4(socket_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!asker) {
      // No file descriptors: the other process waits a moment.
      if (errno != EAGAIN) ::poll(&waiting[1], 1, 100);
      continue;
    }
    std::lock_guard lock(mutex_);
    [[maybe_unused]] const ssize_t sent =
        ::send(asker.get(), owner_.data(), owner_.size(), MSG_NOSIGNAL);
  }
}

std::string claimed_by(const LcmUrl& url) {
  if (url.scheme == "memq") return "";
  if (url.scheme == "unix")
    return is_unix_served(url.host) ? "one that does not say who it is" : "";
  const Name name = name_of(url);
  const FileHandle socket = local_socket(SOCK_NONBLOCK);
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&name.address), name.size) != 0) {
    return errno == EAGAIN ? "one that does not say who it is" : "";
  }
  std::string line;
  for (pollfd waiting{socket.get(), POLLIN, 0};
       line.size() < kLongestLine && ::poll(&waiting, 1, kAnswerMs) == 1;) {
    char bytes[kLongestLine];
    const ssize_t size = ::recv(socket.get(), bytes, sizeof bytes, 0);
    if (size <= 0) break;
    for (const char c : std::string(bytes, static_cast<size_t>(size)))
      line += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return line.empty() ? "one that does not say who it is" : line;
}

}  // namespace ruedo::bus
