// Events by the format in base/lcm_log.h, handed to the system in large pieces.
#include "log/writer.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

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

// An empty file that no other process writes: two would write over each other.
int open_empty(const std::string& path) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  const auto fail = [&](const std::string& why) {
    if (file >= 0) ::close(file);
    throw EnvironmentError("--record: cannot write '" + path + "': " + why);
  };
  struct stat status{};
  if (file < 0 || ::fstat(file, &status) != 0) fail(std::strerror(errno));
  if (!S_ISREG(status.st_mode)) return file;
  if (::flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)  // else: it knows no locks
    fail("another run records into it; end that one, or record elsewhere");
  if (::ftruncate(file, 0) != 0) fail(std::strerror(errno));
  return file;
}

}  // namespace

Writer::Writer(const std::string& path) : Writer(open_empty(path), path) {}

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
  if (error_.empty()) {
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

void Writer::fail(int error_number) {
  error_ = std::strerror(error_number);
  if (::ftruncate(file_.get(), written_) != 0) error_ += "; its last event is cut off";
}

}  // namespace ruedo::log
