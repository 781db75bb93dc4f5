#include "bus/stream_connection.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include <poll.h>
#include <sys/socket.h>

#include "base/big_endian.h"
#include "bus/tcpq_wire.h"

namespace ruedo::bus {
namespace {

constexpr size_t kRoom = size_t{256} << 10;    // bytes received at a time
constexpr size_t kLargest = size_t{64} << 20;  // a frame: the server is trusted no further

}  // namespace

StreamConnection::StreamConnection(FileHandle socket) : socket_(std::move(socket)) {
  send(tcpq::client_hello());
  buffer_.resize(kRoom);
}

bool StreamConnection::send(const std::vector<uint8_t>& bytes) {
  for (size_t sent = 0; sent < bytes.size();) {
    const ssize_t count = ::send(socket_.get(), &bytes[sent], bytes.size() - sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {  // part of a frame may be there: nothing sensible can follow
      ::shutdown(socket_.get(), SHUT_RDWR);
      return false;
    }
    sent += static_cast<size_t>(count);
  }
  return true;
}

// Publishers are notified, too.
bool StreamConnection::end() {
  over_ = true;
  ::shutdown(socket_.get(), SHUT_RDWR);
  return false;
}

bool StreamConnection::publish(std::string_view channel, const uint8_t* data, size_t size) {
  const std::lock_guard lock(sending_);
  frame_.clear();
  tcpq::append_publish(frame_, channel, {data, size});
  return send(frame_);
}

bool StreamConnection::subscribe(std::string_view name) {
  const std::lock_guard lock(sending_);
  frame_.clear();
  tcpq::append_subscribe(frame_, name);
  return send(frame_);
}

bool StreamConnection::unsubscribe(std::string_view name) {
  const std::lock_guard lock(sending_);
  frame_.clear();
  tcpq::append_unsubscribe(frame_, name);
  return send(frame_);
}

bool StreamConnection::receive(int timeout_ms, const Handler& handler) {
  if (over_) return false;
  pollfd waiting{socket_.get(), POLLIN, 0};
  if (timeout_ms != 0 && ::poll(&waiting, 1, timeout_ms) <= 0) return false;
  if (begin_ > 0) {
    std::memmove(buffer_.data(), &buffer_[begin_], end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  if (buffer_.size() - end_ < kRoom / 2) buffer_.resize(2 * buffer_.size());
  const ssize_t count = ::recv(socket_.get(), &buffer_[end_], buffer_.size() - end_, MSG_DONTWAIT);
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return false;
  if (count <= 0) return end();
  end_ += static_cast<size_t>(count);
  bool any = false;
  if (!greeted_ && end_ >= 8) {
    if (read_big_endian<uint32_t>(buffer_.data()) != tcpq::kServerMagic) return end();
    greeted_ = true, begin_ = 8;
  }
  while (greeted_ && end_ - begin_ >= 12) {
    const uint8_t* frame = &buffer_[begin_];
    const size_t name = read_big_endian<uint32_t>(frame + 4);
    if (name > tcpq::kLongestChannel) return end();
    if (end_ - begin_ < 12 + name) break;
    const size_t size = read_big_endian<uint32_t>(frame + 8 + name);
    if (size > kLargest) return end();
    if (end_ - begin_ < 12 + name + size) break;
    begin_ += 12 + name + size;
    handler({reinterpret_cast<const char*>(frame + 8), name}, frame + 12 + name, size);
    any = true;
  }
  return any;
}

}  // namespace ruedo::bus
