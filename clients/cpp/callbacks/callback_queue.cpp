// The calls that wait, and the threads that run them.
#include "callbacks/callback_queue.h"

#include <condition_variable>
#include <cstdio>
#include <deque>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "callbacks/callbacks.h"

namespace ruedo::client {
namespace {

constexpr size_t kMostWaiting = size_t{1} << 20;  // bytes of samples
constexpr size_t kOverhead = 100;                 // bytes, of a sample

// The queues whose calls this thread is in.
struct Running {
  const void* queue;
  const Running* outer;
};
thread_local const Running* innermost = nullptr;

}  // namespace

struct CallbackQueue::State {
  struct Waiting {
    Call call;
    std::string on;
    Count missed;  // null: the call gets no sample, and is never dropped
    size_t cost = 0;
  };

  void put(Waiting one);
  std::deque<Waiting> drop();
  bool run_one(std::unique_lock<std::mutex>& lock);
  void run_waiting();
  void run();

  mutable std::mutex mutex;  // everything below
  std::condition_variable news, returned;
  std::deque<Waiting> waiting;
  size_t bytes = 0;
  std::string runs_on;  // of the call that runs
  bool running = false, closed = false, started = false;
  bool keeps_all = false, told = false;
  int borrowed = 0;  // threads that run them instead
};

CallbackQueue::CallbackQueue() : state_(std::make_shared<State>()) {}

CallbackQueue::~CallbackQueue() { stop(); }

void CallbackQueue::start() {
  const std::lock_guard lock(state_->mutex);
  if (state_->started || state_->closed) return;
  std::thread([state = state_] { state->run(); }).detach();
  state_->started = true;
}

void CallbackQueue::keep_all() {
  const std::lock_guard lock(state_->mutex);
  state_->keeps_all = true;
}

void CallbackQueue::put(Call call, const std::string& on) {
  state_->put({std::move(call), on, nullptr, 0});
}

void CallbackQueue::put_sample(Call call, const std::string& on, const Count& missed, size_t size) {
  state_->put({std::move(call), on, missed, size + kOverhead});
}

void CallbackQueue::State::put(Waiting one) {
  std::deque<Waiting> dropped;  // which ends without the lock
  const std::lock_guard lock(mutex);
  if (closed) return;
  bytes += one.cost;
  waiting.push_back(std::move(one));
  if (bytes > kMostWaiting && !keeps_all) dropped = drop();
  if (borrowed == 0) news.notify_one();
}

std::deque<CallbackQueue::State::Waiting> CallbackQueue::State::drop() {
  std::set<Count> seen;
  std::deque<Waiting> kept, dropped;
  for (auto one = waiting.rbegin(); one != waiting.rend(); ++one) {
    if (!one->missed || seen.insert(one->missed).second) {
      kept.push_front(std::move(*one));
      continue;
    }
    ++*one->missed;
    bytes -= one->cost;
    dropped.push_back(std::move(*one));
  }
  waiting = std::move(kept);
  if (!dropped.empty() && !std::exchange(told, true)) {
    std::fputs(
        "ruedo: callbacks are slower than their samples: they get only the newest sample of each "
        "channel, and dropped() of each stream counts the others (shown once)\n",
        stderr);
  }
  return dropped;
}

bool CallbackQueue::is_idle() const {
  const std::lock_guard lock(state_->mutex);
  return state_->waiting.empty() && !state_->running;
}

bool CallbackQueue::runs_here() const {
  const Running* one = innermost;
  while (one && one->queue != state_.get()) one = one->outer;
  return one != nullptr;
}

bool CallbackQueue::any_runs_here() { return innermost != nullptr; }

// False: nothing waits.
bool CallbackQueue::State::run_one(std::unique_lock<std::mutex>& lock) {
  returned.wait(lock, [this] { return !running; });
  if (waiting.empty()) return false;
  {
    Waiting one = std::move(waiting.front());
    waiting.pop_front();
    bytes -= one.cost;
    runs_on = one.on;
    running = true;
    lock.unlock();
    const Running here{this, innermost};
    innermost = &here;
    one.call();
    one.call = nullptr;  // what it holds may be the user's
    innermost = here.outer;
  }
  lock.lock();
  running = false;
  returned.notify_all();
  return true;
}

void CallbackQueue::State::run() {
  std::unique_lock lock(mutex);
  for (;;) {
    news.wait(lock, [this] { return closed || (!waiting.empty() && borrowed == 0); });
    if (closed) return;
    run_one(lock);
  }
}

void CallbackQueue::State::run_waiting() {
  std::unique_lock lock(mutex);
  while (run_one(lock)) {
  }
}

void CallbackQueue::run_waiting() { state_->run_waiting(); }

CallbackQueue::Borrowed::Borrowed(CallbackQueue& queue) : state_(queue.state_) {
  const std::lock_guard lock(state_->mutex);
  ++state_->borrowed;
}

CallbackQueue::Borrowed::~Borrowed() {
  state_->run_waiting();
  const std::lock_guard lock(state_->mutex);
  --state_->borrowed;
  state_->news.notify_one();
}

void CallbackQueue::stop() {
  std::deque<State::Waiting> dropped;  // which ends without the lock
  const std::lock_guard lock(state_->mutex);
  state_->closed = true;
  dropped.swap(state_->waiting);
  state_->news.notify_all();
}

void CallbackQueue::await_call() {
  std::unique_lock lock(state_->mutex);
  const auto has_returned = [this] { return !state_->running; };
  if (state_->returned.wait_for(lock, kLongTime, has_returned)) return;
  say_awaited(state_->runs_on);
  state_->returned.wait(lock, has_returned);
}

}  // namespace ruedo::client
