#include "system/output_file.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/input_file.h"
#include "ruedo/errors.h"
#include "system/file_handle.h"

namespace fs = std::filesystem;

namespace ruedo {
namespace {

constexpr size_t kLongestStem = 200;  // of a name, which has 255 bytes at most

// A file in a folder that takes no others, or one that is mounted by itself.
bool is_for_in_place_alone(int reason) {
  return reason == EACCES || reason == EPERM || reason == EROFS || reason == EBUSY ||
         reason == EXDEV;
}

// A file without a name, of which nothing is left when the process is killed; -1 where the file
// system has none. Its path is good for as long as the process lives.
int open_unnamed(const fs::path& folder, std::string& path) {
  const int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666);
  if (file < 0) return -1;
  path = "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(file);
  if (::access(path.c_str(), W_OK) == 0) return file;
  ::close(file);  // without /proc it could never be given a name
  return -1;
}

std::string part_of(const fs::path& file, const fs::path& folder, int number) {
  std::string name = file.filename().string().substr(0, kLongestStem) + ".part";
  name += std::to_string(::getpid());
  if (number > 0) name += "_" + std::to_string(number);
  return (folder / name).string();
}

// make: whether it could make a new file of that name; else errno has the reason.
// Returns the name, or "".
template <class Make>
std::string made_part(const fs::path& file, const fs::path& folder, Make make) {
  constexpr int kMost = 100;  // of a process of the same number, which were left
  for (int number = 0; number < kMost; ++number) {
    std::string part = part_of(file, folder, number);
    if (make(part)) return part;
    if (errno != EEXIST) break;
  }
  return "";
}

// The target of a path: a descriptor of this process, as /dev/stdout does, or a file, which need
// not be there yet.
struct Target {
  fs::path file;
  int descriptor = -1;
};

Target target_of(const std::string& path) {
  constexpr int kMostLinks = 40;  // as in the kernel
  const std::string descriptors = "/proc/" + std::to_string(::getpid()) + "/fd";
  Target target{path};
  std::error_code error;
  for (int links = 0; links < kMostLinks && fs::is_symlink(target.file, error); ++links) {
    const fs::path folder = fs::canonical(fs::absolute(target.file).parent_path(), error);
    if (folder == descriptors) {
      target.descriptor = std::stoi(target.file.filename().string());
      return target;
    }
    target.file = folder / fs::read_symlink(target.file, error);
  }
  return target;
}

}  // namespace

void check_output(const std::string& path) {
  if (was_read(path))
    throw InputError({}, path + " is one of the files that are read for this, which would be lost");
}

OutputFile::OutputFile(const std::string& path) : path_(path), part_(path) {
  check_output(path);
  std::error_code error;
  before_ = fs::status(path, error);
  if (fs::exists(before_) && ::access(path.c_str(), W_OK) != 0) fail(errno);
  const Target target = target_of(path);
  target_ = target.file.string();
  if (target.descriptor < 0 && fs::is_symlink(target_, error)) fail(ELOOP);
  open(target.descriptor);
}

void OutputFile::open(int descriptor) {
  const bool itself = descriptor >= 0 || (fs::exists(before_) && !fs::is_regular_file(before_));
  int file = -1;
  if (descriptor >= 0) {
    file = ::fcntl(descriptor, F_DUPFD_CLOEXEC, 0);  // from where it is on
  } else if (itself) {
    file = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    file = open_part();
  }
  if (file < 0) fail(errno);
  file_.reset(::fdopen(file, itself ? "wb" : "w+b"));
}

int OutputFile::open_part() {
  int file = -1;
  const auto made_in = [&](const fs::path& folder, mode_t mode) {
    part_ = made_part(target_, folder, [&](const std::string& part) {
      file = ::open(part.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, mode);
      return file >= 0;
    });
    return file;
  };
  const fs::path folder = fs::absolute(target_).parent_path();
  file = open_unnamed(folder, part_);
  is_named_ = file < 0;
  if (!is_named_ || made_in(folder, 0666) >= 0) return file;
  const int reason = errno;
  std::error_code error;
  const fs::path elsewhere = fs::temp_directory_path(error);
  if (fs::exists(before_) && is_for_in_place_alone(reason) && !error)
    return made_in(elsewhere, 0600);
  errno = reason;
  return -1;
}

OutputFile::~OutputFile() {
  if (!kept_ && part_ != path_ && is_named_) ::unlink(part_.c_str());
}

void OutputFile::write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) fail(errno);
}

void OutputFile::keep() {
  if (std::fflush(file_.get()) != 0) fail(errno);
  check_output(path_);  // again: more may have been read since
  if (part_ != path_) {
    if (fs::exists(before_)) take_over_rights();
    if (!is_named_) name();
    if (::rename(part_.c_str(), target_.c_str()) == 0)
      kept_ = true;
    else if (!fs::exists(before_) || !is_for_in_place_alone(errno) || !copy())
      fail(errno);
  }
}

// Gives the part a name, to be renamed: no call puts a file without one in another's place.
void OutputFile::name() {
  const std::string unnamed = part_;
  part_ = made_part(target_, fs::absolute(target_).parent_path(), [&](const std::string& part) {
    return ::linkat(AT_FDCWD, unnamed.c_str(), AT_FDCWD, part.c_str(), AT_SYMLINK_FOLLOW) == 0;
  });
  if (part_.empty()) fail(errno);
  is_named_ = true;
}

// Those of the file that was there: root may write over a user's.
void OutputFile::take_over_rights() const {
  struct stat there{};
  const int file = ::fileno(file_.get());
  if (::stat(target_.c_str(), &there) != 0) return;
  if (::fchown(file, there.st_uid, there.st_gid) != 0) {
    // It is another user's, in a folder that is ours.
  }
  ::fchmod(file, there.st_mode & 07777);
}

// Into the file that was there. False: errno says why.
bool OutputFile::copy() const {
  const FileHandle to(::open(target_.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC));
  std::array<char, 1 << 16> piece{};
  if (std::fseek(file_.get(), 0, SEEK_SET) != 0) return false;
  while (to) {
    const size_t count = std::fread(piece.data(), 1, piece.size(), file_.get());
    if (count == 0) return std::ferror(file_.get()) == 0;
    if (write_all(to.get(), piece.data(), count) != count) break;
  }
  return false;
}

void OutputFile::fail(int reason) const {
  throw EnvironmentError(path_ + " cannot be written: " + std::strerror(reason));
}

void write_file(const std::string& path, std::string_view bytes) {
  OutputFile file(path);
  file.write(bytes);
  file.keep();
}

}  // namespace ruedo
