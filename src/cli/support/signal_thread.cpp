// The thread that waits for signals.
#include "cli/support/signal_thread.h"

#include <cstdlib>

#include <pthread.h>

#include "run/run.h"
#include "system/leftovers.h"

namespace ruedo::cli {

SignalThread::SignalThread() {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  struct sigaction hang_up{};
  if (sigaction(SIGHUP, nullptr, &hang_up) == 0 && hang_up.sa_handler != SIG_IGN)
    sigaddset(&signals_, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals_, &before_);
  thread_ = std::thread([this] { wait(); });
}

SignalThread::~SignalThread() {
  done_ = true;
  // It is blocked, and only wakes the thread. NOLINTNEXTLINE(bugprone-bad-signal-to-kill-thread)
  pthread_kill(thread_.native_handle(), SIGTERM);
  thread_.join();
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

void SignalThread::wait() {
  for (int signal = 0; sigwait(&signals_, &signal) == 0;) {
    if (done_) return;
    run::Run* server = server_;
    if (!server || told_ != 0) {  // without a run to end cleanly, or if it does not end
      remove_leftovers();
      std::_Exit(128 + signal);
    }
    told_ = signal;
    server->stop();
  }
}

}  // namespace ruedo::cli
