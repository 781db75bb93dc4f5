#include "core/output_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include "core/file_handle.h"
#include "ruedo/errors.h"

namespace fs = std::filesystem;

namespace ruedo {
namespace {

[[noreturn]] void fail(const std::string& path, int reason) {
  throw EnvironmentError(path + " cannot be written: " + std::strerror(reason));
}

// 0, or errno.
int written(const std::string& path, int flags, std::string_view bytes) {
  const FileHandle file(::open(path.c_str(), O_WRONLY | O_CLOEXEC | flags, 0666));
  return file && write_all(file.get(), bytes.data(), bytes.size()) == bytes.size() ? 0 : errno;
}

// By a new file that takes its name. 0, or errno.
int replaced(const std::string& target, const fs::file_status& status, std::string_view bytes) {
  std::error_code error;
  const std::string part = target + ".part" + std::to_string(::getpid());
  int reason = written(part, O_CREAT | O_EXCL, bytes);
  if (reason == 0 && fs::exists(status)) fs::permissions(part, status.permissions(), error);
  if (reason == 0 && ::rename(part.c_str(), target.c_str()) != 0) reason = errno;
  if (reason != 0 && reason != EEXIST) ::unlink(part.c_str());
  return reason;
}

}  // namespace

void write_file(const std::string& path, std::string_view bytes) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    if (const int reason = written(path, 0, bytes)) fail(path, reason);
    return;
  }
  if (fs::exists(status) && ::access(path.c_str(), W_OK) != 0) fail(path, errno);
  // A symbolic link stays one.
  const std::string target = fs::exists(status) ? fs::canonical(path).string() : path;
  int reason = replaced(target, status, bytes);
  // A file in a folder that takes no others, or one that is mounted by itself.
  const bool in_place_alone =
      reason == EACCES || reason == EPERM || reason == EROFS || reason == EBUSY;
  if (in_place_alone && fs::exists(status)) reason = written(target, O_TRUNC, bytes);
  if (reason != 0) fail(path, reason);
}

}  // namespace ruedo
