// Callbacks that can be cancelled while other threads call them.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "callbacks/callback_faults.h"
#include "ruedo/client.h"
#include "transport/forked.h"

namespace ruedo::client {

// For a callback that close() waits for, before it says so.
inline constexpr std::chrono::seconds kLongTime(5);
void say_awaited(const std::string& what);

// The state behind a Subscription.
class CallbackCore {
 public:
  // faults: keeps what it throws; null: that is printed once.
  CallbackCore(std::string what, std::shared_ptr<CallbackFaults> faults)
      : what_(std::move(what)), faults_(std::move(faults)) {}
  virtual ~CallbackCore() = default;

  // After it returns, the callback is not called any more: it waits for a call in another thread.
  // May be called from the callback itself. Where callbacks close each other, the last of them does
  // not wait. In a fork's child it has nothing to end.
  void close();
  bool closed() const { return closed_; }
  // Called once it was cancelled.
  void at_close(std::function<void()> leave) { leave_ = std::move(leave); }

 protected:
  // A call of it by this thread, perhaps within another one of it; those of other threads wait.
  class Call {
   public:
    explicit Call(CallbackCore& core);
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

   private:
    CallbackCore& core_;
  };

  void fail(const std::exception_ptr& fault);

  const std::string what_;  // it is called on, for the log
  const std::shared_ptr<CallbackFaults> faults_;
  const Forked forked_;
  std::atomic<bool> closed_{false};

 private:
  void await_call();
  bool waits_for_this_thread() const;

  std::mutex mutex_;
  std::condition_variable returned_;
  int calls_ = 0;                        // under way, one in another
  std::atomic<std::thread::id> runner_;  // whose they are
  bool failed_ = false;
  std::function<void()> leave_;
};

template <class... Arguments>
class Callback : public CallbackCore {
 public:
  using Function = std::function<void(Arguments...)>;
  Callback(std::string what, std::shared_ptr<CallbackFaults> faults, Function function)
      : CallbackCore(std::move(what), std::move(faults)), function_(std::move(function)) {}

  // An exception of the callback harms no other callback.
  void call(Arguments... arguments) {
    const Call call(*this);
    if (closed_) return;
    try {
      function_(arguments...);
    } catch (...) {
      fail(std::current_exception());
    }
  }

 private:
  const Function function_;
};

// All callbacks on one thing. Thread safe; one that is added or removed during a call may or may
// not be called.
template <class... Arguments>
class CallbackList : public std::enable_shared_from_this<CallbackList<Arguments...>> {
 public:
  using One = Callback<Arguments...>;

  // faults: of the user's callbacks; null for this library's own.
  explicit CallbackList(std::shared_ptr<CallbackFaults> faults = nullptr)
      : faults_(std::move(faults)) {}

  // Throws std::invalid_argument for an empty function.
  std::shared_ptr<One> add(std::string what, typename One::Function function) {
    if (!function) throw std::invalid_argument(what + ": the callback is an empty function");
    auto one = std::make_shared<One>(std::move(what), faults_, std::move(function));
    one->at_close([list = this->weak_from_this(), raw = one.get()] {
      if (const auto here = list.lock()) here->remove(raw);
    });
    const std::lock_guard lock(mutex_);
    auto next = std::make_shared<std::vector<std::shared_ptr<One>>>(*all_);
    next->push_back(one);
    all_ = std::move(next);
    return one;
  }
  void remove(const One* gone) {
    const std::lock_guard lock(mutex_);
    auto next = std::make_shared<std::vector<std::shared_ptr<One>>>(*all_);
    next->erase(std::remove_if(next->begin(), next->end(),
                               [&](const auto& one) { return one.get() == gone; }),
                next->end());
    all_ = std::move(next);
  }
  bool empty() const { return snapshot()->empty(); }
  void call(Arguments... arguments) const {
    const All all = snapshot();  // one that leaves meanwhile lives on until the loop's end
    for (const auto& one : *all) one->call(arguments...);
  }

 private:
  using All = std::shared_ptr<const std::vector<std::shared_ptr<One>>>;
  All snapshot() const {
    const std::lock_guard lock(mutex_);
    return all_;
  }
  const std::shared_ptr<CallbackFaults> faults_;
  mutable std::mutex mutex_;
  All all_ = std::make_shared<const std::vector<std::shared_ptr<One>>>();
};

}  // namespace ruedo::client
