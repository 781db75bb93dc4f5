// Events by the format in base/lcm_log.h, handed to the system in large pieces.
#include "log/writer.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/big_endian.h"
#include "base/input_file.h"
#include "base/lcm_log.h"
#include "base/message_size.h"
#include "ruedo/errors.h"

namespace ruedo::log {
namespace {

constexpr size_t kFlushSize = 1 << 20;  // bytes

bool is_fifo(const std::string& path) {
  struct stat status{};
  const bool is = ::stat(path.c_str(), &status) == 0 && S_ISFIFO(status.st_mode);
  errno = ENXIO;
  return is;
}

// Here a FIFO without a reader would stall the run, deaf to signals.
int open_to_write(const std::string& path, const std::function<void()>& wait) {
  constexpr useconds_t kPause_us = 50'000;
  for (;;) {
    const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_NONBLOCK | O_CLOEXEC, 0666);
    if (file >= 0) ::fcntl(file, F_SETFL, O_WRONLY);
    if (file >= 0 || errno != ENXIO || !is_fifo(path)) return file;
    if (wait) wait();
    ::usleep(kPause_us);
  }
}

// An empty file that no other process writes: two would write over each other.
int open_empty(const std::string& path, const std::function<void()>& wait) {
  const int file = open_to_write(path, wait);
  const auto fail = [&](const std::string& why) {
    if (file >= 0) ::close(file);
    throw EnvironmentError("--record: cannot write '" + path + "': " + why);
  };
  struct stat status{};
  if (file < 0 || ::fstat(file, &status) != 0) fail(std::strerror(errno));
  if (!S_ISREG(status.st_mode)) return file;
  if (::flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)  // else: it knows no locks
    fail("another run records into it; end that one, or record elsewhere");
  if (status.st_size == 0 || ::ftruncate(file, 0) == 0) return file;
  // Some file systems (FUSE) cannot do that: another one takes its place.
  if (::unlink(std::filesystem::weakly_canonical(path).c_str()) != 0) fail(std::strerror(errno));
  ::close(file);
  return open_empty(path, wait);
}

}  // namespace

Writer::Writer(const std::string& path, const std::function<void()>& wait)
    : Writer(open_empty(path, wait), path) {}

Writer::Writer(int file, std::string name) : path_(std::move(name)), file_(file) {
  buffer_.reserve(2 * kFlushSize);
  ends_.reserve(4096);
}

Writer::~Writer() {
  flush();
  struct stat status{};
  if (::fstat(file_.get(), &status) == 0 && status.st_nlink > 0)
    ::fdatasync(file_.get());  // what was closed must survive a power cut
}

void Writer::write(int64_t timestamp_us, const std::string& channel, const uint8_t* data,
                   size_t size) {
  if (!error_.empty()) return;
  if (size > kLargestMessage) {  // readers take it for damage
    flush();
    error_ = "a message of " + std::to_string(size) + " bytes on " + channel + "; at most " +
             std::to_string(kLargestMessage) + " are allowed";
    return;
  }
  append_big_endian(buffer_, kLogSync);
  append_big_endian(buffer_, static_cast<uint64_t>(first_number_ + events_++));
  append_big_endian(buffer_, static_cast<uint64_t>(timestamp_us));
  append_big_endian(buffer_, static_cast<uint32_t>(channel.size()));
  append_big_endian(buffer_, static_cast<uint32_t>(size));
  buffer_.insert(buffer_.end(), channel.begin(), channel.end());
  buffer_.insert(buffer_.end(), data, data + size);
  ends_.push_back(buffer_.size());
  if (buffer_.size() >= kFlushSize) flush();
}

void Writer::flush() {
  if (is_whole()) {
    const size_t done = write_all(file_.get(), buffer_.data(), buffer_.size());
    const int error_number = errno;
    size_t whole = 0;  // bytes of whole events
    for (size_t end : ends_) whole = end <= done ? end : whole;
    written_ += static_cast<int64_t>(whole);
    if (done < buffer_.size()) fail(error_number);
  }
  buffer_.clear();
  ends_.clear();
}

// The next write would fill what is missing with zeros.
bool Writer::is_whole() {
  struct stat status{};
  if (error_.empty() && ::fstat(file_.get(), &status) == 0 && S_ISREG(status.st_mode) &&
      status.st_size < written_)
    lose("truncated (" + std::to_string(status.st_size) + " bytes are left of " +
         std::to_string(written_) + ")");
  return error_.empty();
}

void Writer::look_for_file() {
  struct stat open{}, named{};
  if (!is_whole() || ::fstat(file_.get(), &open) != 0 || !S_ISREG(open.st_mode)) return;
  if (::stat(path_.c_str(), &named) != 0)
    lose("removed");
  else if (named.st_ino != open.st_ino || named.st_dev != open.st_dev)
    lose("replaced by another");
}

void Writer::truncate() {
  buffer_.clear();
  ends_.clear();
  written_ = events_ = 0;
  error_.clear();
  if (::ftruncate(file_.get(), 0) != 0 || ::lseek(file_.get(), 0, SEEK_SET) != 0)
    error_ = std::strerror(errno);
}

std::string Writer::append(const Writer& other) {
  const std::string fault = copy(other.file_.get(), other.path_, 0, other.written_);
  if (fault.empty()) events_ = other.events_;
  return fault;
}

std::string Writer::append(const std::string& path, int64_t begin, int64_t end, int64_t events) {
  flush();
  if (!error_.empty()) return error_;
  std::string fault;
  try {
    fault = copy(::fileno(open_input(path).file.get()), path, begin, end);
  } catch (const InputError& error) {
    fault = error.what();
  }
  if (fault.empty()) events_ += events;
  return fault;
}

std::string Writer::copy(int file, const std::string& path, int64_t begin, int64_t end) {
  std::vector<uint8_t> piece(kFlushSize);
  for (int64_t done = begin; done < end;) {
    const size_t wanted = std::min(piece.size(), static_cast<size_t>(end - done));
    const ssize_t got = ::pread(file, piece.data(), wanted, done);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return got < 0 ? std::strerror(errno) : path + " is shorter than it was";
    if (write_all(file_.get(), piece.data(), static_cast<size_t>(got)) < static_cast<size_t>(got))
      return std::strerror(errno);
    done += got;
  }
  written_ += end - begin;
  return "";
}

void Writer::lose(const std::string& how) {
  error_ = "the file was " + how + " while the run wrote it, and the log is lost";
  lost_ = true;
}

void Writer::fail(int error_number) {
  error_ = std::strerror(error_number);
  if (::ftruncate(file_.get(), written_) != 0) error_ += "; its last event is cut off";
}

}  // namespace ruedo::log
