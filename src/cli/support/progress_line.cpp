#include "cli/support/progress_line.h"

#include <algorithm>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <thread>

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "base/progress.h"
#include "base/utf8.h"
#include "base/whole.h"
#include "system/to_stderr.h"

namespace ruedo::cli {
namespace {

using Clock = Progress::Clock;

constexpr auto kNext = std::chrono::milliseconds(200);
constexpr double kEnoughToGuess_s = 2.0;  // of what was done, before the rest is guessed from it

// A quick command needs no line. Tests need one at once.
std::chrono::milliseconds first_after() {
  const char* named = std::getenv("RUEDO_PROGRESS_AFTER_MS");
  return std::chrono::milliseconds(named != nullptr ? std::atoi(named) : 1000);
}

size_t columns() {
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 20;
  return known ? size.ws_col - 1u : 79u;
}

std::string duration(double seconds) {
  const int64_t all = rounded(std::clamp(seconds, 0.0, 1e9));
  return all < 60     ? fmt::format("{} s", all)
         : all < 3600 ? fmt::format("{}:{:02} min", all / 60, all % 60)
                      : fmt::format("{}:{:02} h", all / 3600, all % 3600 / 60);
}

std::string text_of(const Progress::State& state, size_t width) {
  const double seconds = std::chrono::duration<double>(Clock::now() - state.begin).count();
  std::string figures = ", " + duration(seconds);
  if (state.whole > 0) {
    const double part =
        std::clamp(static_cast<double>(state.done) / static_cast<double>(state.whole), 0.0, 1.0);
    figures = fmt::format(": {:.0f} %", 100.0 * part);
    if (part > 0.0 && seconds > kEnoughToGuess_s)
      figures += fmt::format(", {} left", duration(seconds / part - seconds));
  }
  std::string what = for_terminal(state.what);
  const size_t room = width - std::min(width, figures.size());
  if (what.size() > room && room > 3) what = "..." + what.substr(what.size() - (room - 3));
  return what + figures;
}

// Lives as long as the program: another thread may still report its end to it.
class Line {
 public:
  void begin() {
    due_ = Clock::now() + first_after();
    Progress::watch([this] {
      const std::lock_guard lock(mutex_);
      show();
    });
    // Signals are other threads' to handle, some of which block them to wait for them.
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    thread_ = std::jthread([this](const std::stop_token& stop) {
      std::unique_lock lock(mutex_);
      while (!stop.stop_requested()) {
        changed_.wait_for(lock, stop, kNext, [] { return false; });
        if (!stop.stop_requested()) show();
      }
    });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }

  bool end() {
    if (!thread_.joinable()) return false;
    thread_.request_stop();
    thread_.join();
    Progress::watch({});
    const std::lock_guard lock(mutex_);
    erase();
    return true;
  }

 private:
  void show() {
    const auto state = Progress::latest();
    if (!state) return erase();
    if (Clock::now() < due_) return;
    to_stderr("\r\033[K{}", text_of(*state, columns()));
    drawn_ = true;
  }

  void erase() {
    if (!drawn_) return;
    to_stderr("\r\033[K");
    drawn_ = false;
  }

  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool drawn_ = false;
  Clock::time_point due_;
  std::jthread thread_;
};

Line& line() {
  static Line one;
  return one;
}

}  // namespace

void begin_progress_line() {
  if (isatty(STDERR_FILENO) != 0) line().begin();
}

bool end_progress_line() { return line().end(); }

std::string progress_text() {
  const auto state = Progress::latest();
  return state ? text_of(*state, columns()) : "";
}

}  // namespace ruedo::cli
