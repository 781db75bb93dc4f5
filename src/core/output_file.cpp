#include "core/output_file.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include "core/file_handle.h"
#include "core/input_file.h"
#include "ruedo/errors.h"

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

std::string part_of(const fs::path& file, const fs::path& folder) {
  const std::string name =
      file.filename().string().substr(0, kLongestStem) + ".part" + std::to_string(::getpid());
  return (folder / name).string();
}

}  // namespace

void check_output(const std::string& path) {
  if (was_read(path))
    throw InputError({}, path + " is one of the files that are read for this, which would be lost");
}

OutputFile::OutputFile(const std::string& path) : path_(path), target_(path), part_(path) {
  check_output(path);
  std::error_code error;
  before_ = fs::status(path, error);
  if (fs::exists(before_) && ::access(path.c_str(), W_OK) != 0) fail(errno);
  if (fs::is_regular_file(before_)) target_ = fs::canonical(path).string();
  open();
}

void OutputFile::open() {
  const bool itself = fs::exists(before_) && !fs::is_regular_file(before_);
  int file = -1;
  if (itself) {
    file = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    constexpr int kNew = O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC;
    const fs::path folder = fs::absolute(target_).parent_path();
    file = open_unnamed(folder, part_);
    is_named_ = file < 0;
    if (is_named_) {
      part_ = part_of(target_, folder);
      file = ::open(part_.c_str(), kNew, 0666);
    }
    if (file < 0 && fs::exists(before_) && is_for_in_place_alone(errno)) {
      part_ = part_of(target_, fs::temp_directory_path());
      file = ::open(part_.c_str(), kNew, 0600);
    }
  }
  if (file < 0) fail(errno);
  file_.reset(::fdopen(file, itself ? "wb" : "w+b"));
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
    std::error_code error;
    if (fs::exists(before_)) fs::permissions(part_, before_.permissions(), error);
    if (!is_named_) name();
    if (::rename(part_.c_str(), target_.c_str()) == 0)
      kept_ = true;
    else if (!fs::exists(before_) || !is_for_in_place_alone(errno) || !copy())
      fail(errno);
  }
}

// Gives the part a name, to be renamed: no call puts a file without one in another's place.
void OutputFile::name() {
  const std::string named = part_of(target_, fs::absolute(target_).parent_path());
  if (::linkat(AT_FDCWD, part_.c_str(), AT_FDCWD, named.c_str(), AT_SYMLINK_FOLLOW) != 0)
    fail(errno);
  part_ = named;
  is_named_ = true;
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
