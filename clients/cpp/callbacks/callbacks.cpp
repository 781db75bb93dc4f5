// Cancelling callbacks, and what they throw.
#include "callbacks/callbacks.h"

#include <cstdio>
#include <map>

namespace ruedo::client {

namespace {

struct Waits {
  std::mutex mutex;
  std::map<std::thread::id, const CallbackCore*> all;  // which callback a thread waits for
};

}  // namespace

CallbackCore::Call::Call(CallbackCore& core) : core_(core) {
  const std::thread::id me = std::this_thread::get_id();
  std::unique_lock lock(core.mutex_);
  core.returned_.wait(lock, [&] { return core.calls_ == 0 || core.runner_.load() == me; });
  core.runner_ = me;
  ++core.calls_;
}

CallbackCore::Call::~Call() {
  const std::lock_guard lock(core_.mutex_);
  if (--core_.calls_ > 0) return;
  core_.runner_ = std::thread::id();
  core_.returned_.notify_all();
}

void CallbackCore::close() {
  if (forked_) return;
  const bool first = !closed_.exchange(true);
  await_call();
  if (first && leave_) std::exchange(leave_, nullptr)();
}

void CallbackCore::await_call() {
  auto& waits = of_this_process<Waits>();
  const std::thread::id me = std::this_thread::get_id();
  {
    const std::lock_guard lock(waits.mutex);
    if (waits_for_this_thread()) return;
    waits.all[me] = this;
  }
  {
    std::unique_lock lock(mutex_);
    const auto has_returned = [this] { return calls_ == 0; };
    if (!returned_.wait_for(lock, kLongTime, has_returned)) {
      say_awaited(what_);
      returned_.wait(lock, has_returned);
    }
  }
  const std::lock_guard lock(waits.mutex);
  waits.all.erase(me);
}

// Whether this thread runs it, or runs another callback that its thread waits for.
bool CallbackCore::waits_for_this_thread() const {
  const auto& all = of_this_process<Waits>().all;
  const CallbackCore* one = this;
  while (one->runner_.load() != std::this_thread::get_id()) {
    const auto found = all.find(one->runner_);
    if (found == all.end()) return false;
    one = found->second;
  }
  return true;
}

void say_awaited(const std::string& what) {
  std::fprintf(stderr,
               "ruedo: a callback on %s has not returned for %lld s: close() waits for it\n",
               what.c_str(), static_cast<long long>(kLongTime.count()));
}

void CallbackCore::fail(const std::exception_ptr& fault) {
  if ((faults_ && faults_->keep(fault, what_)) || std::exchange(failed_, true)) return;
  std::fprintf(stderr, "ruedo: a callback on %s failed: %s; it stays subscribed (shown once)\n",
               what_.c_str(), text_of(fault).c_str());
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
