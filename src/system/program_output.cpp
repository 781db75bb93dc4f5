#include "system/program_output.h"

#include <cerrno>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "system/end_with_parent.h"
#include "system/file_handle.h"

namespace ruedo {
namespace {

// Runs in the child, between fork and exec: system calls only.
[[noreturn]] void become(char* const* arguments, int output, ItsErrors errors, pid_t parent) {
  end_with_parent(parent);
  ::dup2(output, STDOUT_FILENO);
  if (errors == ItsErrors::dropped)
    ::dup2(::open("/dev/null", O_WRONLY | O_CLOEXEC), STDERR_FILENO);
  ::execv(arguments[0], arguments);
  ::_exit(127);
}

}  // namespace

std::optional<std::string> output_of(std::vector<std::string> words, ItsErrors errors) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return std::nullopt;
  const FileHandle output(ends[0]);
  FileHandle input(ends[1]);
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();  // posix_spawn leaves a child behind when this process is killed
  if (child < 0) return std::nullopt;
  if (child == 0) become(arguments.data(), input.get(), errors, parent);
  input = FileHandle();
  std::string text;
  char part[4096];
  for (ssize_t size; (size = ::read(output.get(), part, sizeof part)) != 0;) {
    if (size > 0)
      text.append(part, static_cast<size_t>(size));
    else if (errno != EINTR)
      break;
  }
  int status = 1;
  while (::waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return std::nullopt;
  }
  return status == 0 ? std::optional(text) : std::nullopt;
}

}  // namespace ruedo
