// The thread that runs the user's callbacks, so that receiving never waits for them.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace ruedo::client {

// Runs calls one at a time, in the order in which they came. Thread safe.
class CallbackQueue {
  struct State;

 public:
  using Call = std::function<void()>;
  using Count = std::shared_ptr<std::atomic<int64_t>>;

  CallbackQueue();
  ~CallbackQueue();  // stops

  void start();     // makes the thread; a second time nothing
  void keep_all();  // the sender waits for the callbacks: from now on no call is dropped
  // on: what the call is on, for the log.
  void put(Call call, const std::string& on);
  // A sample of so many bytes. Where more than a megabyte of them waits, the newest of each stream
  // stays, and the stream's `missed` counts the others.
  void put_sample(Call call, const std::string& on, const Count& missed, size_t size);
  bool is_idle() const;
  bool runs_here() const;       // this thread is in one of its calls
  static bool any_runs_here();  // or in one of another queue
  void stop();                  // nothing runs any more, but for the call that has begun
  void await_call();            // waits for that one, and names it where it takes long

  // While it lives, and at its end, the caller's thread runs what comes.
  class Borrowed {
   public:
    explicit Borrowed(CallbackQueue& queue);
    ~Borrowed();
    Borrowed(const Borrowed&) = delete;
    Borrowed& operator=(const Borrowed&) = delete;

   private:
    const std::shared_ptr<State> state_;
  };
  void run_waiting();  // for the borrower: returns when all earlier calls have returned

 private:
  const std::shared_ptr<State> state_;  // the thread has one, too: a call may destroy the queue
};

}  // namespace ruedo::client
