#include "cli/support/launcher_pipe.h"

#include <cerrno>
#include <csignal>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include <unistd.h>

namespace ruedo::cli {

struct LauncherPipe::Paced {
  void on_line(std::string_view line) {
    const auto read = run::read_launcher_progress(line);
    if (!read) return;
    const std::lock_guard lock(mutex);
    last = read;
    if (run) run->note_progress(*last);
  }
  void pace(run::Run* paced) {
    const std::lock_guard lock(mutex);
    run = paced;
    if (run && last) run->note_progress(*last);
  }

  std::mutex mutex;
  std::optional<run::LauncherProgress> last;
  run::Run* run = nullptr;
};

LauncherPipe::LauncherPipe(bool waits) : paced_(std::make_shared<Paced>()) {
  if (waits) paced_->last.emplace();
  std::thread([paced = paced_] {
    char bytes[4096];
    std::string said;
    for (;;) {
      const ssize_t count = read(STDIN_FILENO, bytes, sizeof bytes);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) break;
      said.append(bytes, static_cast<size_t>(count));
      const size_t end = said.rfind('\n');
      if (end != std::string::npos) {  // the last line says all that those before it did
        const std::string_view lines(said.data(), end);
        paced->on_line(lines.substr(lines.rfind('\n') + 1));
        said.erase(0, end + 1);
      }
      if (said.size() > sizeof bytes) said.clear();
    }
    kill(getpid(), SIGTERM);
  }).detach();
}

void LauncherPipe::pace(run::Run* run) { paced_->pace(run); }

LauncherPipe::Pacing::Pacing(std::optional<LauncherPipe>& pipe, run::Run& run) : pipe_(pipe) {
  if (pipe_) pipe_->pace(&run);
}

LauncherPipe::Pacing::~Pacing() {
  if (pipe_) pipe_->pace(nullptr);
}

}  // namespace ruedo::cli
