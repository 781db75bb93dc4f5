#include "model/child_process.h"

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/file_handle.h"

namespace ruedo::model {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const char* what) {
  throw std::runtime_error(std::string(what) + ": " + std::strerror(errno));
}

void set_limit(decltype(RLIMIT_AS) which, rlim_t value) {
  const rlimit limit{value, value};
  ::setrlimit(which, &limit);
}

// Runs in the child, between fork and exec: system calls only. posix_spawn cannot set limits.
[[noreturn]] void become(char* const* arguments, const char* log, const ProcessLimits& limits,
                         pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // the thread that waits for it is gone
  if (::getppid() != parent) ::_exit(127);
  set_limit(RLIMIT_CORE, 0);
  set_limit(RLIMIT_CPU, limits.cpu_s);
  set_limit(RLIMIT_FSIZE, limits.file_bytes);
  if (limits.memory_bytes > 0) set_limit(RLIMIT_AS, limits.memory_bytes);
  const int nothing = ::open("/dev/null", O_RDWR);
  const int messages = ::open(log, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  ::dup2(nothing, 0);
  ::dup2(nothing, 1);
  ::dup2(messages, 2);
  ::execvp(arguments[0], arguments);
  ::_exit(127);
}

// Becomes readable when the process ends. Invalid on kernels before 5.3, where the caller polls.
class ProcessHandle {
 public:
  explicit ProcessHandle(pid_t process)
      : handle_(static_cast<int>(::syscall(SYS_pidfd_open, process, 0))) {}
  void wait(int timeout_ms) const {
    pollfd ended{handle_.get(), POLLIN, 0};
    ::poll(&ended, 1, timeout_ms);  // ignores a negative descriptor
  }

 private:
  FileHandle handle_;
};

void kill_group(pid_t process) {
  ::kill(-process, SIGKILL);
  ::kill(process, SIGKILL);  // the child may not have its own process group yet
  ::waitpid(process, nullptr, 0);
}

}  // namespace

TemporaryFolder::TemporaryFolder(const std::string& purpose) {
  path_ = (fs::temp_directory_path() / ("ruedo-" + purpose + "-XXXXXX")).string();
  if (!::mkdtemp(path_.data())) fail("no temporary folder");
  leftover_.emplace(path_);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  fs::remove_all(path_, error);
}

std::optional<int> run_limited(std::vector<std::string> words, const std::string& log,
                               const ProcessLimits& limits, const std::function<bool()>& give_up) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();  // posix_spawn sets no limits
  if (child < 0) fail("no process can be started");
  if (child == 0) become(arguments.data(), log.c_str(), limits, parent);

  const ProcessHandle handle(child);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(limits.wall_s);
  for (;;) {
    int status = 0;
    const pid_t ended = ::waitpid(child, &status, WNOHANG);
    if (ended == child) return status;
    if (ended < 0 && errno != EINTR) fail("the process is lost");
    if (std::chrono::steady_clock::now() > deadline || (give_up && give_up())) {
      kill_group(child);
      return std::nullopt;
    }
    handle.wait(20);
  }
}

}  // namespace ruedo::model
