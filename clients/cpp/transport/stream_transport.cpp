#include "transport/stream_transport.h"

#include <poll.h>

#include <algorithm>
#include <thread>

#include "bus/stream_socket.h"
#include "bus/unix_socket.h"
#include "ruedo/client.h"
#include "ruedo/errors.h"

namespace ruedo::client {
namespace {

constexpr std::chrono::milliseconds kAgain(100);
constexpr std::chrono::microseconds kLookTime(50);

FileHandle socket_to(const bus::LcmUrl& address) {
  if (address.scheme == "unix") return bus::connect_unix(address.host);
  std::string why;
  FileHandle socket = bus::connect_tcp(address.host, std::to_string(address.port), why);
  if (!socket) throw EnvironmentError("nothing listens at " + address.str() + " (" + why + ")");
  return socket;
}

bool is_readable(int file, int timeout_ms) {
  pollfd waiting{file, POLLIN, 0};
  return ::poll(&waiting, 1, timeout_ms) > 0;
}

}  // namespace

StreamTransport::StreamTransport(const bus::LcmUrl& address) : address_(address) {
  try {
    connect();
  } catch (const EnvironmentError& error) {
    throw NoServer(error.what());
  }
}

void StreamTransport::connect() {
  auto made = std::make_shared<bus::StreamConnection>(socket_to(address_));
  const std::lock_guard lock(mutex_);
  for (const std::string& channel : channels_) made->subscribe(channel);
  connection_ = std::move(made);
}

std::shared_ptr<bus::StreamConnection> StreamTransport::connection() {
  const std::lock_guard lock(mutex_);
  return connection_;
}

void StreamTransport::subscribe(const std::string& channel) {
  const std::lock_guard lock(mutex_);
  channels_.insert(channel);
  if (connection_) connection_->subscribe(channel);
}

void StreamTransport::unsubscribe(const std::string& channel) {
  const std::lock_guard lock(mutex_);
  channels_.erase(channel);
  if (connection_) connection_->unsubscribe(channel);
}

void StreamTransport::publish(const std::string& channel, const uint8_t* bytes, size_t size) {
  if (const auto open = connection()) open->publish(channel, bytes, size);
}

bool StreamTransport::has_news() {
  const auto open = connection();
  // In that order: what has left the socket is in hand.
  return open && (is_readable(open->file(), 0) || busy_);
}

bool StreamTransport::receive(bus::StreamConnection& from, const Receiver& receiver) {
  busy_ = true;
  const bool any = from.receive(0, receiver);
  busy_ = false;
  return any;
}

bool StreamTransport::receive(std::chrono::milliseconds timeout, const Receiver& receiver) {
  const auto open = connection();
  if (!open) {  // waiting threads notice by their timeouts
    std::this_thread::sleep_for(std::min(timeout, kAgain));
    try {
      connect();
    } catch (const EnvironmentError&) {
      return false;  // it is tried again with the next call
    }
    return false;
  }
  // Waking a thread takes as long as a step of a small world: poll before sleeping.
  static const bool may_look_again = std::thread::hardware_concurrency() > 1;
  const auto sleep_at = std::chrono::steady_clock::now() + kLookTime;
  do {
    if (receive(*open, receiver)) return true;
  } while (may_look_again && timeout.count() > 0 && !open->is_over() &&
           std::chrono::steady_clock::now() < sleep_at);
  if (!open->is_over() && is_readable(open->file(), static_cast<int>(timeout.count())) &&
      receive(*open, receiver))
    return true;
  if (open->is_over()) {
    const std::lock_guard lock(mutex_);
    connection_.reset();
  }
  return false;
}

}  // namespace ruedo::client
