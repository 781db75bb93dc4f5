// Events go to the log, to the journal and to the watcher from one place, so that all of them see one order.
#include "run/recorder.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <unistd.h>

#include "ruedo/errors.h"

namespace ruedo::run {
namespace {

namespace fs = std::filesystem;

const std::string kHeader = "ruedo/header", kApplied = "ruedo/applied", kStateHash = "ruedo/state_hash";
constexpr const char* kSuffix = ".snapshot";

// A file without a name, which goes when it is closed, however the process ends.
int open_nameless(const std::string& folder) {
  const int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0) return file;
  std::string path = folder + "/.journal-XXXXXX";    // a file system without O_TMPFILE
  const int named = ::mkstemp(path.data());
  if (named < 0) throw EnvironmentError("--snapshots: cannot write in '" + folder + "': " + std::strerror(errno));
  ::unlink(path.c_str());
  return named;
}

// A file that is removed again unless it is kept: what was written of a snapshot would go on taking a full disk's room.
class PartOfFile {
 public:
  explicit PartOfFile(std::string path) : path_(std::move(path)) {}
  ~PartOfFile() {
    if (!path_.empty()) ::unlink(path_.c_str());
  }
  PartOfFile(const PartOfFile&) = delete;
  PartOfFile& operator=(const PartOfFile&) = delete;
  const std::string& path() const { return path_; }
  // Under its own name, on the disk before this returns; what went wrong, or "".
  std::string keep_as(const std::string& path) {
    std::string fault = synced(path_, O_RDONLY);
    if (fault.empty() && ::rename(path_.c_str(), path.c_str()) != 0) fault = std::strerror(errno);
    if (!fault.empty()) return fault;
    path_.clear();
    return synced(fs::path(path).parent_path().string(), O_RDONLY | O_DIRECTORY);
  }

 private:
  static std::string synced(const std::string& path, int flags) {
    const int file = ::open(path.c_str(), flags | O_CLOEXEC);
    const bool good = file >= 0 && ::fsync(file) == 0;
    const std::string fault = good ? "" : std::strerror(errno);
    if (file >= 0) ::close(file);
    return fault;
  }

  std::string path_;
};

}  // namespace

Recorder::Recorder(const std::string& log, const std::string& snapshots, Watcher watcher) : folder_(snapshots), watcher_(std::move(watcher)) {
  if (!log.empty()) log_ = std::make_unique<log::Writer>(log);
  if (!snapshots.empty()) journal_ = std::make_unique<log::Writer>(open_nameless(snapshots), "the journal in " + snapshots);
}

template <class Message>
void Recorder::record(const std::string& channel, const Message& message) {
  buffer_.resize(static_cast<size_t>(message.getEncodedSize()));
  message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
  this->message(message.utime, channel, buffer_.data(), buffer_.size());
}

void Recorder::begin(const log_header_t& header) {
  record(kHeader, header);
  begin_journal(header);
}

void Recorder::begin_journal(const log_header_t& header) {
  if (!journal_) return;
  journal_->truncate();
  journal_base_us_ = base_us_;
  buffer_.resize(static_cast<size_t>(header.getEncodedSize()));
  header.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
  journal_->write(0, kHeader, buffer_.data(), buffer_.size());
}

void Recorder::begin_anew(SimTime passed, const log_header_t& header) {
  set_back(passed);
  begin_journal(header);
}

void Recorder::set_back(SimTime passed) { base_us_ += passed; }

void Recorder::message(SimTime utime, const std::string& channel, const uint8_t* data, size_t size) {
  const SimTime stamp = base_us_ + utime;
  if (log_) log_->write(stamp, channel, data, size);
  if (watcher_) watcher_(stamp, channel, data, size);
}

void Recorder::applied(const applied_t& applied) {
  record(kApplied, applied);
  if (journal_) journal_->write(base_us_ - journal_base_us_ + applied.utime, kApplied, buffer_.data(), buffer_.size());
}

void Recorder::files(const log_header_t& header) {
  record(kHeader, header);
  if (journal_) journal_->write(base_us_ - journal_base_us_ + header.utime, kHeader, buffer_.data(), buffer_.size());
}

void Recorder::state_hash(const state_hash_t& hash) { record(kStateHash, hash); }

void Recorder::flush() {
  if (log_) log_->flush();
  if (journal_) journal_->flush();
}

void Recorder::check(SimTime now) const {
  if (!log_ || log_->error().empty()) return;
  throw EnvironmentError("--record: " + log_->path() + ": " + log_->error() + ". The log is readable up to " +
                         std::to_string(now / 1000000) + " s of sim time: make room, or record elsewhere");
}

std::string Recorder::snapshot_path(const std::string& name) const {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
  };
  if (name.empty() || name.size() > 63 || name[0] == '.' || !std::all_of(name.begin(), name.end(), allowed)) return "";
  return folder_ + "/" + name + kSuffix;
}

std::string Recorder::save_snapshot(const std::string& name, const state_hash_t& state) {
  const std::string path = snapshot_path(name);
  PartOfFile part(folder_ + "/." + name + ".part");
  std::error_code error;
  size_t files = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) files += entry.path().extension() == kSuffix;
  if (files >= kMostSnapshots && !fs::exists(path, error)) return "the folder holds " + std::to_string(files) + " snapshots already";
  journal_->flush();
  if (!journal_->error().empty()) return "the journal is incomplete: " + journal_->error();
  try {
    log::Writer writer(part.path());
    const std::string fault = writer.append(*journal_);
    if (!fault.empty()) return fault;
    buffer_.resize(static_cast<size_t>(state.getEncodedSize()));
    state.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
    writer.write(base_us_ - journal_base_us_ + state.utime, kStateHash, buffer_.data(), buffer_.size());
    writer.flush();
    return writer.error().empty() ? part.keep_as(path) : writer.error();
  } catch (const EnvironmentError& fault) {
    return fault.what();
  }
}

}  // namespace ruedo::run
