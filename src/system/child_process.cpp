#include "system/child_process.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "ruedo/errors.h"
#include "system/end_with_parent.h"
#include "system/file_handle.h"

namespace ruedo {
namespace {

constexpr size_t kMessages_bytes = size_t{64} << 10;

[[noreturn]] void fail(const char* what) {
  throw EnvironmentError(std::string(what) + ": " + std::strerror(errno));
}

// A file without a name, in memory.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) : file_(::memfd_create(name, MFD_CLOEXEC)) {
    if (!file_) fail("no memory for the output of another program");
  }
  MemoryFile(const char* name, std::string_view content) : MemoryFile(name) {
    if (write_all(get(), content.data(), content.size()) != content.size())
      fail("no memory for the input of another program");
    ::lseek(get(), 0, SEEK_SET);
  }
  int get() const { return file_.get(); }

  // The last bytes of it, `most` at most.
  std::string end(size_t most) const {
    const off_t size = std::max<off_t>(::lseek(get(), 0, SEEK_END), 0);
    std::string bytes(std::min(most, static_cast<size_t>(size)), '\0');
    off_t at = size - static_cast<off_t>(bytes.size());
    for (size_t done = 0; done < bytes.size();) {
      const ssize_t count = ::pread(get(), bytes.data() + done, bytes.size() - done, at);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) fail("what another program wrote cannot be read");
      done += static_cast<size_t>(count);
      at += count;
    }
    return bytes;
  }

 private:
  FileHandle file_;
};

void set_limit(decltype(RLIMIT_AS) which, rlim_t value) {
  const rlimit limit{value, value};
  ::setrlimit(which, &limit);
}

// Runs in the child, between fork and exec: system calls only. posix_spawn cannot set limits.
[[noreturn]] void become(char* const* arguments, int input, int output, int messages,
                         const ProcessLimits& limits, const ReadySandbox* sandbox, pid_t parent) {
  ::setpgid(0, 0);
  end_with_parent(parent);
  set_limit(RLIMIT_CORE, 0);
  set_limit(RLIMIT_CPU, limits.cpu_s);
  set_limit(RLIMIT_FSIZE, limits.output_bytes);
  if (limits.memory_bytes > 0) set_limit(RLIMIT_AS, limits.memory_bytes);
  ::dup2(input, 0);
  ::dup2(output, 1);
  ::dup2(messages, 2);
  if (sandbox && !sandbox->enter()) ::_exit(126);
  ::syscall(SYS_close_range, 3u, ~0u, 0u);  // what a shell left open for us is not for it
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

// The status, as in ProcessResult.
std::optional<int> wait_for(pid_t child, int wall_s, const std::function<bool()>& give_up) {
  const ProcessHandle handle(child);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(wall_s);
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

}  // namespace

ProcessResult run_limited(std::vector<std::string> words, const ProcessLimits& limits,
                          const std::function<bool()>& give_up, std::string_view input) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::optional<ReadySandbox> sandbox;
  if (limits.sandbox) sandbox.emplace(*limits.sandbox);
  const MemoryFile read("input", input), output("output"), messages("messages");
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();  // posix_spawn sets no limits
  if (child < 0) fail("no process can be started");
  if (child == 0) {
    become(arguments.data(), read.get(), output.get(), messages.get(), limits,
           sandbox ? &*sandbox : nullptr, parent);
  }
  ProcessResult result{wait_for(child, limits.wall_s, give_up), {}, {}};
  if (!result.status) return result;
  result.output = output.end(limits.output_bytes);
  result.messages = messages.end(kMessages_bytes);
  return result;
}

}  // namespace ruedo
