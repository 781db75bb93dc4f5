// fork and exec of a shell (posix_spawn cannot have it end with this program), and a thread that
// waits for it.
#include "cli/support/client_process.h"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include <sys/wait.h>
#include <unistd.h>

#include "ruedo/errors.h"
#include "system/end_with_parent.h"

namespace ruedo::cli {
namespace {

constexpr auto kPatience = std::chrono::seconds(5);
constexpr auto kLook = std::chrono::milliseconds(5);

}  // namespace

ClientProcess::ClientProcess(const std::string& command, const std::vector<std::string>& variables,
                             std::function<void()> ended) {
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
    ::execle("/bin/sh", "sh", "-c", command.c_str(), nullptr, pointers.data());
    ::_exit(127);
  }
  ::setpgid(pid_, pid_);  // whoever of the two comes first
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

ClientProcess::~ClientProcess() { end(); }

bool ClientProcess::end() {
  if (pid_ < 0) return true;
  const bool by_itself = over_;
  const auto begin = std::chrono::steady_clock::now();
  if (!over_) ::kill(-pid_, SIGTERM);
  while (!over_ && std::chrono::steady_clock::now() < begin + kPatience)
    std::this_thread::sleep_for(kLook);
  ::kill(-pid_,
         SIGKILL);  // and the processes that it left behind; its own id is not reused before it is
                    // waited for
  waiter_.join();
  leftover_.reset();
  ::waitpid(pid_, &status_, 0);
  pid_ = -1;
  return by_itself;
}

void ClientProcess::wait() {
  while (!over_) std::this_thread::sleep_for(kLook);
  end();
}

std::string ClientProcess::fault() const {
  if (WIFSIGNALED(status_)) return "signal " + std::to_string(WTERMSIG(status_));
  return WEXITSTATUS(status_) == 0 ? "" : "exit code " + std::to_string(WEXITSTATUS(status_));
}

}  // namespace ruedo::cli
