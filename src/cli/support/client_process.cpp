// fork and exec of bash (posix_spawn cannot have it end with this program), and a thread that waits
// for it.
#include "cli/support/client_process.h"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "ruedo/errors.h"
#include "system/end_with_parent.h"

namespace ruedo::cli {
namespace {

constexpr auto kPatience = std::chrono::seconds(5);
constexpr auto kLook = std::chrono::milliseconds(5);

// Before the user's line. The first command that fails ends it. A shell forgets how a program in
// the background ended: so its number is noted before the next command, and it is waited for at the
// end; and `wait` alone fails as a program in the background did.
constexpr const char* kShell = "/bin/bash";
constexpr const char* kPrologue = R"sh(set -e -o pipefail
shopt -s inherit_errexit
wait() {
  if (($#)); then builtin wait "$@"; return; fi
  local code=0 job
  for job in "${!ruedo_jobs[@]}"; do ((job == 0)) || builtin wait "$job" || code=$?; done
  return $code
}
trap 'ruedo_jobs[${!:-0}]=' DEBUG
trap 'code=$? late=0; wait || late=$?; exit $((code ? code : late))' EXIT
)sh";

}  // namespace

ClientProcess::ClientProcess(const std::string& command, const std::vector<std::string>& variables,
                             std::function<void()> ended, const std::vector<int>& inherited) {
  if (::access(kShell, X_OK) != 0) {
    throw EnvironmentError("'" + command + "' needs " + kShell +
                           ", which is not there: " + std::strerror(errno));
  }
  std::vector<std::string> environment = variables;
  for (char** variable = environ; *variable; ++variable) {
    const std::string name = std::string(*variable).substr(0, std::strcspn(*variable, "=") + 1);
    bool replaced = false;
    for (const std::string& own : variables) replaced |= own.rfind(name, 0) == 0;
    if (!replaced) environment.emplace_back(*variable);
  }
  std::vector<char*> pointers;
  for (std::string& variable : environment) pointers.push_back(variable.data());
  pointers.push_back(nullptr);
  const std::string script = kPrologue + command;
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ < 0)
    throw EnvironmentError("'" + command + "' cannot be started: " + std::strerror(errno));
  if (pid_ == 0) {  // only what is safe after fork in a program with threads
    sigset_t none;
    sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    ::setpgid(0, 0);
    end_with_parent(parent);
    for (const int descriptor : inherited) ::fcntl(descriptor, F_SETFD, 0);
    ::execle(kShell, "bash", "-c", script.c_str(), nullptr, pointers.data());
    ::_exit(127);
  }
  ::setpgid(pid_, pid_);  // whichever of the two processes runs first
  leftover_.emplace(pid_);
  waiter_ = std::thread([this, ended = std::move(ended)] {
    siginfo_t info;
    while (::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOWAIT) != 0 &&
           errno == EINTR) {
    }
    over_ = true;
    ended();
  });
}

ClientProcess::~ClientProcess() { end(kPatience); }

void ClientProcess::wait_until(std::chrono::steady_clock::time_point time) const {
  while (!over_ && std::chrono::steady_clock::now() < time) std::this_thread::sleep_for(kLook);
}

void ClientProcess::end(std::chrono::duration<double> grace) {
  if (pid_ < 0) return;
  using Clock = std::chrono::steady_clock;
  const auto half = std::chrono::duration_cast<Clock::duration>(grace / 2);
  const Clock::time_point begin = Clock::now();
  wait_until(begin + half);
  told_ = !over_ && ::kill(-pid_, SIGTERM) == 0;
  wait_until(begin + 2 * half);
  killed_ = !over_;
  reap();
}

// Also kills the processes that it left behind: its own id is not reused before it is waited for.
void ClientProcess::reap() {
  ::kill(-pid_, SIGKILL);
  waiter_.join();
  leftover_.reset();
  ::waitpid(pid_, &status_, 0);
  pid_ = -1;
}

void ClientProcess::wait() {
  while (!over_) std::this_thread::sleep_for(kLook);
  reap();
}

std::string ClientProcess::fault() const {
  const int signal = WIFSIGNALED(status_) ? WTERMSIG(status_) : 0;
  const int code = signal != 0 ? 128 + signal : WEXITSTATUS(status_);
  // 255: of bash, where what it waits for was ended while it waited.
  if (told_ && (code == 128 + SIGTERM || code == 255)) return "";
  if (signal != 0) return "signal " + std::to_string(signal);
  return code == 0 ? "" : "exit code " + std::to_string(code);
}

}  // namespace ruedo::cli
