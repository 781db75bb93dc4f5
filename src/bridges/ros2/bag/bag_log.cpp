// Two passes: the attachments are extracted first, then they and the topics are merged by time.
#include "bridges/ros2/bag/bag_log.h"

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <vector>

#include <fmt/format.h>

#include "base/input_file.h"
#include "base/lcm_log.h"
#include "base/utf8.h"
#include "bridges/ros2/bag/rosbag.h"
#include "bridges/ros2/services/restore.h"
#include "log/mcap_reader.h"
#include "log/reader.h"
#include "log/writer.h"
#include "log/zstd_file.h"
#include "ruedo/errors.h"
#include "system/to_stderr.h"

namespace ruedo::ros2 {
namespace {

namespace fs = std::filesystem;

// The one MCAP file of a bag's folder; "" where the folder is not a bag.
std::string file_of_bag(const std::string& folder) {
  std::vector<std::string> files;
  bool is_bag = false, is_sqlite = false;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".mcap") files.push_back(entry.path().string());
    is_bag |= entry.path().filename() == "metadata.yaml";
    is_sqlite |= entry.path().extension() == ".db3";
  }
  if (files.size() == 1) return files.front();
  if (is_sqlite)
    throw InputError({folder},
                     "is a bag with the storage sqlite3; Ruedo reads MCAP, as `ruedo "
                     "export --ros2` writes it");
  throw InputError({folder}, fmt::format("is a folder{}; allowed is a log, or a ROS 2 bag, whose "
                                         "folder has one .mcap file, and this has {}",
                                         is_bag ? " with a metadata.yaml" : "", files.size()));
}

constexpr size_t kMostParts = 64;  // of an attachment's name: folders, and the file

// Where the bag's attachments cannot all be files, each of its name.
[[noreturn]] void refuse_name(const std::string& bag, const std::string& name) {
  throw InputError({bag}, fmt::format("has an attachment '{}'; allowed are names of files, of at "
                                      "most {} parts of 255 bytes each, and none that is another's "
                                      "folder",
                                      shortened(name, 100), kMostParts));
}

void copy_part(const std::string& from, uint64_t offset, uint64_t size, const fs::path& to) {
  const InputFile in = open_input(from);
  std::ofstream out(to, std::ios::binary);
  if (::fseeko(in.file.get(), static_cast<off_t>(offset), SEEK_SET) != 0)
    throw InputError({from}, "cannot be read: " + std::string(std::strerror(errno)));
  std::vector<char> part(size_t{1} << 20);
  for (uint64_t left = size; left > 0;) {
    const size_t count = std::min<uint64_t>(left, part.size());
    if (std::fread(part.data(), 1, count, in.file.get()) != count)
      throw InputError({from}, "became shorter while it was read");
    if (!out.write(part.data(), static_cast<std::streamsize>(count))) break;
    left -= count;
  }
  out.close();
  if (!out) throw EnvironmentError(to.string() + " cannot be written: " + std::strerror(errno));
}

// Below a folder, wherever it was; "" for a name that leads out of it. Makes the folders between.
fs::path place_below(const fs::path& folder, const std::string& name, const std::string& bag) {
  if (name.size() >= PATH_MAX) refuse_name(bag, name);
  const fs::path relative = fs::path(name).lexically_normal().relative_path();
  const bool leads_out = std::any_of(relative.begin(), relative.end(),
                                     [](const fs::path& part) { return part == ".."; });
  if (relative.empty() || leads_out || name.find('\0') != std::string::npos) return {};
  const fs::path place = folder / relative;
  const bool fits =
      relative.has_filename() && relative != "." && place.native().size() < PATH_MAX &&
      static_cast<size_t>(std::distance(relative.begin(), relative.end())) <= kMostParts &&
      std::all_of(
          relative.begin(), relative.end(),
          [](const fs::path& part) { return part.native().size() <= NAME_MAX; });
  std::error_code error;
  if (!fits || fs::is_directory(place, error)) refuse_name(bag, name);
  fs::create_directories(place.parent_path(), error);
  if (error == std::errc::not_a_directory || error == std::errc::file_exists ||
      error == std::errc::filename_too_long)
    refuse_name(bag, name);
  if (error)
    throw EnvironmentError(place.parent_path().string() + " cannot be made: " + error.message());
  return place;
}

// The room that a bag needs on the disk: its length may be forged, and needs none in a sparse file.
class Room {
 public:
  uint64_t left() const { return Rosbag::kMostAttachedBytes - bytes_; }
  void take(const std::string& bag, uint64_t size) {
    if (size > left())
      throw InputError({bag}, fmt::format("has attachments of more than {} bytes in all",
                                          Rosbag::kMostAttachedBytes));
    bytes_ += size;
    if (++count_ > Rosbag::kMostAttachments)
      throw InputError({bag},
                       fmt::format("has more than {} attachments", Rosbag::kMostAttachments));
  }

 private:
  uint64_t bytes_ = 0;
  size_t count_ = 0;
};

}  // namespace

BagLog::BagLog(const std::string& path) : log_(path) {
  std::error_code error;
  const bool is_folder = !path.empty() && fs::is_directory(path, error);
  if (!is_folder && !log::is_mcap(path)) return;
  const std::string file = is_folder ? file_of_bag(path) : path;
  folder_.emplace("bag");
  try {
    restore(file, fs::path(is_folder ? fs::canonical(path) : fs::path(path)).stem().string());
  } catch (const fs::filesystem_error& failure) {
    throw EnvironmentError(failure.path1().string() + ": " + failure.code().message());
  }
}

void BagLog::restore(const std::string& file, const std::string& name) {
  const fs::path run = *folder_ / "run";  // the log, and the world's files beside it
  const std::string rest = *folder_ / Rosbag::kPlainRest;
  fs::create_directories(run);
  log_ = (run / (name + ".lcm")).string();
  const std::ofstream taken(log_);  // its name: an attachment could be a folder of it
  bool has_rest = false;
  Room room;
  const auto extract = [&](const std::string& name, uint64_t offset, uint64_t size) {
    if (name == Rosbag::kRest) {
      has_rest = true;
      room.take(file, log::unpack_part(file, offset, size, rest, room.left()));
      return;
    }
    room.take(file, size);
    const bool is_rest = name == Rosbag::kPlainRest;
    has_rest |= is_rest;
    const fs::path to = is_rest ? fs::path(rest) : place_below(run, name, file);
    if (!to.empty()) copy_part(file, offset, size, to);
  };
  log::read_mcap(file, {{}, extract});
  if (!has_rest)
    throw InputError({file},
                     "holds no run of Ruedo's: its scene is not known. Bags are shown that "
                     "`ruedo export --ros2` made of a log, and that no other program wrote "
                     "anew");
  join(rest, file);
}

void BagLog::join(const std::string& rest, const std::string& file) {
  log::Reader in(rest);
  log::Writer out(log_);
  log::Event event;
  bool more = in.next(event);
  std::set<std::string> written;  // channels that had a message of the rest at its last time
  SimTime written_us = -1;
  const auto write_rest_until = [&](SimTime time_us) {
    for (; more && event.timestamp_us <= time_us; more = in.next(event)) {
      if (event.timestamp_us != written_us) written.clear();
      written_us = event.timestamp_us;
      written.insert(event.channel);
      out.write(event.timestamp_us, event.channel, event.data.data(), event.data.size());
    }
  };
  uint64_t damaged = 0;
  const auto message = [&](const log::McapChannel& channel, uint64_t time_ns,
                           std::span<const uint8_t> cdr) {
    const auto says_all_of = channel.metadata.find(Rosbag::kChannel);
    if (says_all_of == channel.metadata.end()) return;
    const auto time_us = static_cast<SimTime>(time_ns / 1000);
    if (time_us > kLatestLogTime_us) {
      ++damaged;
      return;
    }
    write_rest_until(time_us);
    const std::string& name = says_all_of->second;
    if (written_us == time_us && written.contains(name))
      return;  // the topic's message is not complete
    const std::vector<uint8_t> bytes = ros2::restored(channel.type, cdr);
    if (bytes.empty())
      ++damaged;
    else
      out.write(time_us, name, bytes.data(), bytes.size());
  };
  log::read_mcap(file, {message, {}});
  write_rest_until(INT64_MAX);
  out.flush();
  if (!out.error().empty()) throw EnvironmentError(log_ + " cannot be written: " + out.error());
  if (!in.fault().empty())
    throw InputError({file}, "its " + std::string(Rosbag::kRest) + ": " + in.fault());
  if (damaged > 0) to_stderr("ruedo: {}: {} messages are damaged, and left out\n", file, damaged);
}

}  // namespace ruedo::ros2
