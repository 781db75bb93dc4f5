// Cancelling callbacks, and what they throw.
#include "callbacks.h"

#include <cstdio>

namespace ruedo::client {

void CallbackCore::close() {
  if (forked_) return;
  std::function<void()> leave;
  {
    const std::lock_guard lock(running_);
    if (closed_.exchange(true)) return;
    leave = std::move(leave_);
  }
  if (leave) leave();
}

void CallbackCore::say_failed(const char* why) {
  if (std::exchange(failed_, true)) return;
  std::fprintf(stderr,
               "ruedo: a callback on %s failed: %s; it is called on, and this is said once\n",
               what_.c_str(), why);
}

Subscription::~Subscription() { close(); }

Subscription& Subscription::operator=(Subscription&& other) noexcept {
  if (this != &other) {
    close();
    core_ = std::move(other.core_);
  }
  return *this;
}

void Subscription::close() {
  if (const auto core = std::move(core_)) core->close();
  core_ = nullptr;
}

void Subscription::keep() { core_ = nullptr; }

bool Subscription::open() const { return core_ && !core_->closed(); }

}  // namespace ruedo::client
