#include "base/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <set>

#include "ruedo/errors.h"

namespace ruedo {
namespace {

std::mutex mutex;
std::set<std::string>& files_read() {
  static auto* const paths = new std::set<std::string>;  // outlives every thread
  return *paths;
}

std::string why_not(int error) {
  if (error == ENOENT) return "no such file";
  if (error == ELOOP) return "cannot be read: its symbolic links lead in a circle";
  return std::string("cannot be read: ") + std::strerror(error);
}

[[noreturn]] void fail(const std::string& path) { throw InputError({path, 0}, why_not(errno)); }

}  // namespace

InputFile open_input(const std::string& path) {
  InputFile input = open_to_look(path);
  note_read(path);
  return input;
}

InputFile open_to_look(const std::string& path) {
  // O_NONBLOCK: to open a FIFO would wait for its writer.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) fail(path);
  InputFile input;
  input.file.reset(::fdopen(descriptor, "rb"));
  struct stat info{};
  if (!input.file || ::fstat(descriptor, &info) != 0) {
    if (!input.file) ::close(descriptor);
    fail(path);
  }
  if (S_ISDIR(info.st_mode)) throw InputError({path, 0}, "is a folder; a file is needed");
  if (!S_ISREG(info.st_mode)) throw InputError({path, 0}, "is not a regular file");
  input.size = info.st_size;
  return input;
}

std::string read_input(const std::string& path, size_t max_bytes) {
  const InputFile input = open_input(path);
  if (static_cast<size_t>(input.size) > max_bytes) {
    throw InputError({path, 0}, "has " + std::to_string(input.size) + " bytes; allowed are " +
                                    std::to_string(max_bytes));
  }
  std::string text(static_cast<size_t>(input.size), '\0');
  text.resize(std::fread(text.data(), 1, text.size(), input.file.get()));
  if (std::ferror(input.file.get())) fail(path);
  return text;
}

// Absolute: the caller may change the folder. Not the numbers of inodes: of a file that is removed
// another one may get them.
void note_read(const std::string& path) {
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(path, error);
  const std::lock_guard lock(mutex);
  if (!error) files_read().insert(absolute.string());
}

bool was_read(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  const std::lock_guard lock(mutex);
  return std::any_of(files_read().begin(), files_read().end(), [&](const std::string& file) {
    return std::filesystem::equivalent(file, path, error);
  });
}

}  // namespace ruedo
