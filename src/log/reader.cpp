// Events by the format in base/lcm_log.h. A file is not trusted: every size is checked first.
#include "log/reader.h"

#include <sys/stat.h>

#include <array>
#include <utility>

#include "base/big_endian.h"
#include "base/lcm_log.h"
#include "base/message_size.h"
#include "ruedo/errors.h"

namespace ruedo::log {
namespace {

constexpr uint32_t kMaxChannel = 1000;

// What others play: a bag's folder, and a file of MCAP, which begins with this.
constexpr uint32_t kMcap = 0x894D4341;

[[noreturn]] void refuse_bag(const std::string& path) {
  throw InputError(
      {path},
      "is a ROS 2 bag or an MCAP file; a log is expected, as that which it was exported "
      "from. `ruedo play` shows a bag of `ruedo export --ros2`, too; others play by "
      "`ros2 bag play --clock`, or in Foxglove");
}

bool is_bag_folder(const std::string& path) {
  struct stat status{};
  return stat((path + "/metadata.yaml").c_str(), &status) == 0;
}

}  // namespace

Reader::Reader(const std::string& path, const std::string& doing) : path_(path) {
  if (is_bag_folder(path)) refuse_bag(path);
  InputFile input = open_input(path);
  file_ = std::move(input.file);
  size_ = input.size;
  std::array<uint8_t, 4> sync{};
  if (size_ > 0 &&
      (!read(sync.data(), sync.size()) || read_big_endian<uint32_t>(sync.data()) != kLogSync)) {
    if (read_big_endian<uint32_t>(sync.data()) == kMcap) refuse_bag(path);
    throw InputError({path}, "is not an LCM log: it does not begin with the sync word EDA1DA01");
  }
  std::rewind(file_.get());
  offset_ = 0;
  progress_.emplace(doing + " " + path, size_);
}

bool Reader::read(void* into, size_t size) {
  const size_t got = std::fread(into, 1, size, file_.get());
  offset_ += static_cast<int64_t>(got);
  return got == size;
}

bool Reader::skip(size_t size) {
  if (std::fseek(file_.get(), static_cast<long>(size), SEEK_CUR) != 0) return false;
  offset_ += static_cast<int64_t>(size);
  return true;
}

void Reader::seek(int64_t offset) {
  progress_.reset();
  std::clearerr(file_.get());
  fault_ = std::fseek(file_.get(), static_cast<long>(offset), SEEK_SET) == 0
               ? ""
               : "cannot be read at byte " + std::to_string(offset);
  offset_ = offset;
}

namespace {

constexpr size_t kLookedAt =
    1 << 16;  // bytes at a time in which an event's beginning is looked for

// Whether an event may begin with these bytes.
bool is_head(const uint8_t* head) {
  const auto time = read_big_endian<int64_t>(head + 12);
  return read_big_endian<uint32_t>(head) == kLogSync &&
         read_big_endian<uint32_t>(head + 20) <= kMaxChannel &&
         read_big_endian<uint32_t>(head + 24) <= kLargestMessage && time >= -kLatestLogTime_us &&
         time <= kLatestLogTime_us;
}

int64_t size_by(const uint8_t* head) {
  return int64_t{kLogHeadSize} + read_big_endian<uint32_t>(head + 20) +
         read_big_endian<uint32_t>(head + 24);
}

}  // namespace

// The first one that begins between the two; what only looks like one in a message has no other
// behind it.
std::optional<int64_t> Reader::event_after(int64_t offset, int64_t end) {
  std::vector<uint8_t> bytes(kLookedAt + kLogHeadSize);
  for (; offset < end; offset += kLookedAt) {
    seek(offset);
    const size_t got = std::fread(bytes.data(), 1, bytes.size(), file_.get());
    for (size_t i = 0; i + kLogHeadSize <= got && i < kLookedAt; ++i) {
      const int64_t at = offset + static_cast<int64_t>(i);
      if (at >= end) return {};
      if (!is_head(bytes.data() + i)) continue;
      const int64_t behind = at + size_by(bytes.data() + i);
      std::array<uint8_t, kLogHeadSize> head{};
      seek(behind);
      if (behind == size_ || (read(head.data(), head.size()) && is_head(head.data()))) return at;
    }
  }
  return {};
}

void Reader::seek_time(SimTime time_us) {
  constexpr int64_t kNear = 1 << 20;  // bytes that are read faster than halved
  int64_t low = 0, high = size_;  // an event begins at low, and is before the time, or the first
  while (high - low > kNear) {
    const int64_t middle = low + (high - low) / 2;
    const std::optional<int64_t> found = event_after(middle, high);
    std::array<uint8_t, kLogHeadSize> head{};
    if (found) seek(*found);
    if (found && read(head.data(), head.size()) &&
        read_big_endian<int64_t>(head.data() + 12) < time_us)
      low = *found;
    else
      high = middle;
  }
  seek(low);
}

bool Reader::next(Event& event, const std::function<bool(const std::string&)>& wanted) {
  const bool found = read_event(event, wanted);
  if (!found)
    progress_.reset();
  else if (progress_)
    progress_->to(offset_);
  return found;
}

bool Reader::read_event(Event& event, const std::function<bool(const std::string&)>& wanted) {
  if (!fault_.empty()) return false;
  const int64_t begin = offset_;
  std::array<uint8_t, kLogHeadSize> head{};
  const auto cut_off = [&] {
    fault_ = "cut off in the event that begins at byte " + std::to_string(begin);
    return false;
  };
  if (!read(head.data(), head.size())) return offset_ == begin ? false : cut_off();
  const uint32_t channel_size = read_big_endian<uint32_t>(head.data() + 20);
  const uint32_t data_size = read_big_endian<uint32_t>(head.data() + 24);
  event.number = read_big_endian<int64_t>(head.data() + 4);
  event.timestamp_us = read_big_endian<int64_t>(head.data() + 12);
  if (!is_head(head.data())) {
    fault_ = "damaged at byte " + std::to_string(begin);
    return false;
  }
  // A length that lies must not make memory run out: no event is longer than what is left.
  if (int64_t{channel_size} + data_size > size_ - offset_) return cut_off();
  event.channel.resize(channel_size);
  if (!read(event.channel.data(), channel_size)) return cut_off();
  if (wanted && !wanted(event.channel)) {
    event.data.clear();
    return skip(data_size) || cut_off();
  }
  event.data.resize(data_size);
  return read(event.data.data(), data_size) || cut_off();
}

}  // namespace ruedo::log
