// SIGINT, SIGTERM and SIGHUP (unless that is ignored, as by nohup) end a run cleanly, and other
// long commands at once, with nothing left behind (system/leftovers.h).
#pragma once

#include <atomic>
#include <csignal>
#include <thread>

namespace ruedo::run {
class Run;
}

namespace ruedo::cli {

// Takes them in a thread of its own, since a signal handler may do next to nothing. Make it before
// any other thread, so that all inherit the blocked signals.
class SignalThread {
 public:
  SignalThread();
  ~SignalThread();
  SignalThread(const SignalThread&) = delete;
  SignalThread& operator=(const SignalThread&) = delete;

  // For as long as it lives, a signal stops that run. Without one, and at the second signal, the
  // program ends at once.
  class Serving {
   public:
    Serving(SignalThread& signals, run::Run& server) : signals_(signals) {
      signals_.server_ = &server;
    }
    ~Serving() { signals_.server_ = nullptr; }
    Serving(const Serving&) = delete;
    Serving& operator=(const Serving&) = delete;

   private:
    SignalThread& signals_;
  };
  // The signal that has stopped the run; 0: none.
  int told() const { return told_; }

 private:
  void wait();

  sigset_t signals_{}, before_{};
  std::atomic<bool> done_{false};
  std::atomic<run::Run*> server_{nullptr};
  std::atomic<int> told_{0};
  std::thread thread_;
};

}  // namespace ruedo::cli
