#include "unix_transport.h"

#include <algorithm>
#include <thread>

#include "ruedo/client.h"
#include "ruedo/errors.h"

namespace ruedo::client {
namespace {

constexpr std::chrono::milliseconds kAgain(100);
constexpr std::chrono::microseconds kLookTime(50);

}  // namespace

UnixTransport::UnixTransport(const std::string& path) : path_(path) {
  try {
    connect();
  } catch (const EnvironmentError& error) {
    throw NoServer(error.what());
  }
}

void UnixTransport::connect() {
  auto made = std::make_shared<bus::UnixConnection>(path_);
  for (const std::string& channel : channels_) made->subscribe(channel);
  connection_ = std::move(made);
}

std::shared_ptr<bus::UnixConnection> UnixTransport::connection() {
  const std::lock_guard lock(mutex_);
  return connection_;
}

void UnixTransport::subscribe(const std::string& channel) {
  const std::lock_guard lock(mutex_);
  channels_.insert(channel);
  if (connection_) connection_->subscribe(channel);
}

void UnixTransport::unsubscribe(const std::string& channel) {
  const std::lock_guard lock(mutex_);
  channels_.erase(channel);
  if (connection_) connection_->unsubscribe(channel);
}

void UnixTransport::publish(const std::string& channel, const uint8_t* bytes, size_t size) {
  if (const auto open = connection()) open->publish(channel, bytes, size);
}

bool UnixTransport::receive(std::chrono::milliseconds timeout, const Receiver& receiver) {
  const auto open = connection();
  if (!open) {  // those who wait find out by their timeouts
    std::this_thread::sleep_for(std::min(timeout, kAgain));
    const std::lock_guard lock(mutex_);
    try {
      connect();
    } catch (const EnvironmentError&) {
      return false;
    }
    return false;
  }
  // Waking a thread takes as long as a step of a small world: poll before sleeping.
  static const bool may_look_again = std::thread::hardware_concurrency() > 1;
  const auto sleep_at = std::chrono::steady_clock::now() + kLookTime;
  do {
    if (open->take(0, receiver)) return true;
  } while (may_look_again && timeout.count() > 0 && !open->is_over() &&
           std::chrono::steady_clock::now() < sleep_at);
  if (open->take(static_cast<int>(timeout.count()), receiver)) return true;
  if (open->is_over()) {
    const std::lock_guard lock(mutex_);
    connection_.reset();
  }
  return false;
}

}  // namespace ruedo::client
