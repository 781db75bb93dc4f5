// Records in, snapshots out.
#include "run/journal.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <unistd.h>

#include "log/reader.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "system/file_handle.h"

namespace ruedo::run {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSuffix = ".snapshot";

// A file without a name: it disappears when it is closed, however the process ends.
int open_nameless(const std::string& folder) {
  const int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0) return file;
  std::string path = folder + "/.journal-XXXXXX";  // a file system without O_TMPFILE
  const int named = ::mkstemp(path.data());
  if (named < 0)
    throw EnvironmentError("--snapshots: cannot write in '" + folder +
                           "': " + std::strerror(errno));
  ::unlink(path.c_str());
  return named;
}

// A file that is removed unless it is kept: half a snapshot must not take up room on a full disk.
class PartOfFile {
 public:
  explicit PartOfFile(std::string path) : path_(std::move(path)) {}
  ~PartOfFile() {
    if (!path_.empty()) ::unlink(path_.c_str());
  }
  PartOfFile(const PartOfFile&) = delete;
  PartOfFile& operator=(const PartOfFile&) = delete;
  const std::string& path() const { return path_; }
  // Renames it to its own name; it is on the disk before this returns. Returns the error, or "".
  std::string keep_as(const std::string& path) {
    std::string fault = synced(path_, O_RDONLY);
    if (fault.empty() && ::rename(path_.c_str(), path.c_str()) != 0) fault = std::strerror(errno);
    if (!fault.empty()) return fault;
    path_.clear();
    return synced(fs::path(path).parent_path().string(), O_RDONLY | O_DIRECTORY);
  }

 private:
  static std::string synced(const std::string& path, int flags) {
    const FileHandle file(::open(path.c_str(), flags | O_CLOEXEC));
    return file && ::fsync(file.get()) == 0 ? "" : std::strerror(errno);
  }

  std::string path_;
};

template <class Message>
void write(log::Writer& writer, SimTime stamp_us, const std::string& channel,
           const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  writer.write(stamp_us, channel, bytes.data(), bytes.size());
}

}  // namespace

Journal::Journal(const std::string& folder)
    : folder_(folder), writer_(open_nameless(folder), "the journal in " + folder) {}

void Journal::begin(const log_header_t& header, SimTime stamp_us) {
  writer_.truncate();
  base_us_ = stamp_us;
  write(writer_, 0, kHeaderChannel, header);
  header_end_ = writer_.size();
  fault_.clear();
}

void Journal::begin_with(const log_header_t& header, SimTime stamp_us, const std::string& snapshot,
                         const Extent& extent) {
  begin(header, stamp_us);
  fault_ = writer_.append(snapshot, extent.header_end, extent.end, extent.events);
}

void Journal::message(const Published& message) {
  if (message.channel == kStateHashChannel) return;
  writer_.write(message.stamp_us - base_us_, message.channel, message.data, message.size);
}

std::string Journal::snapshot_path(const std::string& name) const {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  if (name.empty() || name.size() > 63 || name[0] == '.' ||
      !std::all_of(name.begin(), name.end(), allowed))
    return "";
  return folder_ + "/" + name + kSuffix;
}

std::string Journal::save(const std::string& name,
                          const std::function<std::string(log::Writer&)>& fill) {
  const std::string path = snapshot_path(name);
  PartOfFile part(folder_ + "/." + name + ".part");
  std::error_code error;
  size_t files = 0;
  auto bytes = static_cast<uintmax_t>(writer_.size());
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    if (entry.path().extension() != kSuffix) continue;
    const uintmax_t size = entry.file_size(error);
    ++files;
    if (!error) bytes += size;
  }
  if (files >= kMostSnapshots && !fs::exists(path, error))
    return "the folder holds " + std::to_string(files) + " snapshots already";
  if (bytes > kMostBytes)
    return "with this one the folder's snapshots would hold " + std::to_string(bytes) +
           " bytes; allowed are " + std::to_string(kMostBytes);
  writer_.flush();
  const std::string& incomplete = writer_.error().empty() ? fault_ : writer_.error();
  if (!incomplete.empty()) return "the journal is incomplete: " + incomplete;
  try {
    log::Writer snapshot(part.path());
    std::string fault = fill(snapshot);
    if (!fault.empty()) return fault;
    snapshot.flush();
    return snapshot.error().empty() ? part.keep_as(path) : snapshot.error();
  } catch (const std::runtime_error& fault) {
    return fault.what();
  }
}

std::string Journal::save_snapshot(const std::string& name, const state_hash_t& state,
                                   SimTime stamp_us, const std::vector<uint8_t>& bytes) {
  return save(name, [&](log::Writer& snapshot) {
    const std::string fault = snapshot.append(writer_);
    if (fault.empty() && !bytes.empty())
      snapshot.write(stamp_us - base_us_, kStateChannel, bytes.data(), bytes.size());
    if (fault.empty()) write(snapshot, stamp_us - base_us_, kStateHashChannel, state);
    return fault;
  });
}

// Without what acted on that state and on later ones.
std::string Journal::save_past(const std::string& name, int64_t step, SimTime time_us,
                               int32_t epoch, SimTime stamp_us) {
  return save(name, [&](log::Writer& snapshot) -> std::string {
    PartOfFile whole(folder_ + "/." + name + ".whole");
    log::Writer copy(whole.path());
    const std::string fault = copy.append(writer_);
    copy.flush();
    if (!fault.empty() || !copy.error().empty()) return fault + copy.error();
    log::Reader reader(whole.path());
    log::Event event;
    while (reader.next(event)) {
      applied_t applied;
      const bool acted = event.channel == kAppliedChannel;
      if (acted &&
          decode_checked(event.data.data(), event.data.size(), applied) != DecodeFault::none)
        return "the journal is damaged";
      // Where sim time was reset, earlier steps have earlier stamps.
      const SimTime stamp = event.timestamp_us + base_us_;
      if (stamp > stamp_us || (acted && stamp == stamp_us && applied.step == step)) break;
      snapshot.write(event.timestamp_us, event.channel, event.data.data(), event.data.size());
    }
    state_hash_t end{};
    end.utime = time_us;
    end.step = step;
    end.epoch = epoch;
    end.last = true;
    write(snapshot, stamp_us - base_us_, kStateHashChannel, end);
    return "";
  });
}

}  // namespace ruedo::run
