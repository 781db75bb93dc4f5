// A pipe for all clients, and a thread that reads it and sees their processes end.
#include "cli/support/client_pace.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <optional>

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "ruedo/errors.h"
#include "run/run.h"

namespace ruedo::cli {
namespace {

constexpr int32_t kLeft = -1;  // as an epoch: the client has closed its connection

// Removes the last two numbers of a line, which identify its client; nothing if it has none.
std::optional<std::pair<int64_t, int64_t>> take_sender(std::string& line) {
  int64_t numbers[2] = {};
  for (int64_t* const number : {&numbers[1], &numbers[0]}) {
    const size_t space = line.rfind(' ');
    if (space == std::string::npos) return {};
    const char* const end = line.data() + line.size();
    const auto [stop, error] = std::from_chars(line.data() + space + 1, end, *number);
    if (error != std::errc{} || stop != end) return {};
    line.resize(space);
  }
  return std::pair(numbers[0], numbers[1]);
}

}  // namespace

ClientPace::ClientPace(bool waits) : waits_(waits) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0)
    throw EnvironmentError(std::string("no pipe for the client can be made: ") +
                           std::strerror(errno));
  read_ = FileHandle(ends[0]);
  told_ = FileHandle(ends[1]);
  stop_ = FileHandle(::eventfd(0, EFD_CLOEXEC));
  if (!stop_) throw EnvironmentError(std::string("eventfd: ") + std::strerror(errno));
  thread_ = std::thread([this] { watch(); });
}

ClientPace::~ClientPace() {
  ::eventfd_write(stop_.get(), 1);
  thread_.join();
}

std::string ClientPace::variable() const { return "RUEDO_PROGRESS=" + std::to_string(told_.get()); }

void ClientPace::pace(run::Run* run) {
  const std::lock_guard lock(mutex_);
  run_ = run;
  if (!run_ || !waits_) return;
  holds_ = true;
  run_->note_progress(run::LauncherProgress{});
}

void ClientPace::heard() {
  if (heard_.exchange(true) && !holds_) return;
  const std::lock_guard lock(mutex_);
  read_lines();  // a client's first line comes before its first message
  if (clients_.empty() && run_) run_->follow_nobody();
  holds_ = false;
}

void ClientPace::watch() {
  for (;;) {
    std::vector<pollfd> polled{{stop_.get(), POLLIN, 0}, {read_.get(), POLLIN, 0}};
    {
      const std::lock_guard lock(mutex_);
      for (const auto& [client, known] : clients_)
        if (known.process) polled.push_back({known.process.get(), POLLIN, 0});
    }
    if (::poll(polled.data(), polled.size(), -1) < 0 && errno != EINTR) return;
    if (polled[0].revents != 0) return;
    const std::lock_guard lock(mutex_);
    read_lines();
    for (size_t i = 2; i < polled.size(); ++i) {
      if (polled[i].revents == 0) continue;
      std::erase_if(clients_,
                    [&](const auto& each) { return each.second.process.get() == polled[i].fd; });
    }
    tell();
  }
}

void ClientPace::read_lines() {
  char bytes[4096];
  for (ssize_t count; (count = ::read(read_.get(), bytes, sizeof bytes)) > 0;) {
    said_.append(bytes, static_cast<size_t>(count));
    for (size_t end; (end = said_.find('\n')) != std::string::npos; said_.erase(0, end + 1))
      on_line(said_.substr(0, end));
    if (said_.size() > sizeof bytes) said_.clear();
  }
  tell();
}

void ClientPace::on_line(std::string line) {
  const auto sender = take_sender(line);
  const auto progress = run::read_launcher_progress(line);
  if (!sender || !progress) return;
  if (progress->epoch == kLeft) {
    clients_.erase(*sender);
    return;
  }
  Known& known = clients_[*sender];
  known.progress = *progress;
  if (!known.process)
    known.process = FileHandle(
        static_cast<int>(::syscall(SYS_pidfd_open, static_cast<pid_t>(sender->first), 0)));
}

void ClientPace::tell() {
  if (!run_) return;
  if (clients_.empty()) {  // the run stays where the last one left it
    if (std::exchange(followed_, false) && waits_) holds_ = true;
    return;
  }
  run::LauncherProgress slowest{-1, std::numeric_limits<SimTime>::max()};
  for (const auto& [client, known] : clients_)
    slowest.epoch = std::max(slowest.epoch, known.progress.epoch);
  for (const auto& [client, known] : clients_) {
    if (known.progress.epoch != slowest.epoch) continue;
    slowest.received_us = std::min(slowest.received_us, known.progress.received_us);
    slowest.used_us = std::min(slowest.used_us, known.progress.used_us);
  }
  followed_ = true;
  holds_ = false;
  run_->note_progress(slowest);
}

}  // namespace ruedo::cli
