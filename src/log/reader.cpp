// Events by the format in base/lcm_log.h. A file is not trusted: every size is checked first.
#include "log/reader.h"

#include <sys/stat.h>

#include <array>
#include <utility>

#include "base/big_endian.h"
#include "base/lcm_log.h"
#include "base/log_search.h"
#include "ruedo/errors.h"

namespace ruedo::log {
namespace {

// Logs of other programs: a bag's folder, and a file of MCAP, which begins with this.
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

void Reader::seek_time(SimTime time_us) {
  seek(find_log_time(time_us, size_, [this](int64_t offset, uint8_t* into, size_t size) {
    seek(offset);
    return std::fread(into, 1, size, file_.get());
  }));
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
  if (!is_log_head(head.data())) {
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
