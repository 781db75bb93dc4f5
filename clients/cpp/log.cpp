// Reading logs (base/lcm_log.h) from one end to the other: whatever a log's size, one event of it
// is in memory.
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <mutex>

#include "base/big_endian.h"
#include "base/lcm_log.h"
#include "base/log_search.h"
#include "samples/sample_types.h"

namespace ruedo::client {
namespace {

constexpr auto kHeadSize = static_cast<int64_t>(kLogHeadSize);
constexpr int64_t kPassedOver = 1 << 16;  // bytes; more are not read at all

// The events of a log, one after another.
class LogReader {
 public:
  explicit LogReader(const std::string& path) : path_(path) {
    std::error_code error;
    const bool regular = std::filesystem::is_regular_file(path_, error);
    if (regular) file_.open(path_, std::ios::binary);  // opening a FIFO would wait for its writer
    if (!regular || !file_) {
      const bool there = std::filesystem::exists(path_, error);
      throw Error(path_ + (there ? ": it is not a file that can be read" : ": no such file"));
    }
    size_ = static_cast<int64_t>(std::filesystem::file_size(path_));
  }

  // False at the end, and where the log was cut off, or is damaged.
  bool next();
  // Skips events that are all earlier than that time; maybe not all of them.
  void seek_time(int64_t time_us) {
    next_ = find_log_time(time_us, size_, [this](int64_t offset, uint8_t* into, size_t size) {
      file_.clear();
      file_.seekg(offset);
      file_.read(reinterpret_cast<char*>(into), static_cast<std::streamsize>(size));
      return static_cast<size_t>(file_.gcount());
    });
    file_.clear();
    file_.seekg(at_ = next_);
  }

  const std::string& channel() const { return channel_; }
  int64_t time_us() const { return time_us_; }
  std::vector<uint8_t> data();  // of the event; once. Throws Error
  const std::string& fault() const { return fault_; }
  int64_t size() const { return size_; }

 private:
  bool wrong(const char* what) {
    fault_ = what + std::to_string(next_);
    return false;
  }
  bool read(void* into, int64_t size) {
    file_.read(static_cast<char*>(into), size);
    at_ += file_.gcount();
    return file_.gcount() == size;
  }

  const std::string path_;
  std::ifstream file_;
  int64_t size_ = 0, at_ = 0, next_ = 0;  // of the file; where it is read; the next event
  std::string channel_, fault_;
  int64_t time_us_ = 0, data_size_ = 0;
};

bool LogReader::next() {
  constexpr const char *kCutOff = "it was cut off in the event that begins at byte ",
                       *kDamaged = "it is damaged at byte ";
  if (next_ >= size_) return false;
  if (const int64_t between = next_ - at_; between > kPassedOver)
    file_.seekg(next_);
  else if (between > 0)
    file_.ignore(between);
  at_ = next_;
  std::array<uint8_t, kLogHeadSize> head{};
  const bool whole = read(head.data(), kHeadSize);
  if (at_ - next_ < 4) return wrong(kCutOff);
  if (read_big_endian<uint32_t>(head.data()) != kLogSync) return wrong(kDamaged);
  if (!whole) return wrong(kCutOff);
  const int64_t name_size = read_big_endian<uint32_t>(&head[20]);
  data_size_ = read_big_endian<uint32_t>(&head[24]);
  if (name_size > int64_t{kLongestLogChannel} || data_size_ > int64_t{kLargestMessage})
    return wrong(kDamaged);
  // A false length must not exhaust the memory.
  if (at_ + name_size + data_size_ > size_) return wrong(kCutOff);
  time_us_ = read_big_endian<int64_t>(&head[12]);
  channel_.resize(static_cast<size_t>(name_size));
  if (!read(channel_.data(), name_size)) return wrong(kCutOff);
  next_ = at_ + data_size_;
  return true;
}

std::vector<uint8_t> LogReader::data() {
  std::vector<uint8_t> bytes(static_cast<size_t>(data_size_));
  if (!read(bytes.data(), data_size_))
    throw Error(path_ + ": it became shorter since it was opened");
  return bytes;
}

// s to us: infinities mean before and after everything.
int64_t microseconds(double time) {
  constexpr double kLatest = kLatestLogTime_us * 1e-6;
  return std::llround(std::min(std::max(time, -kLatest), kLatest) * 1e6);
}

}  // namespace

class LogFile {
 public:
  explicit LogFile(std::string path) : path_(std::move(path)) {
    LogReader first(path_);
    size_ = first.size();
    if (!first.next() && !first.fault().empty())
      throw Error(path_ + ": it is not an LCM log: " + first.fault());
  }

  struct Contents {
    std::map<std::string, size_t> counts;  // messages by channel
    std::string fault;
  };
  const Contents& contents() const;  // the log is read through for it, once

  // The messages on a channel of these times. Throws Error, and UnknownName.
  void each(const std::string& channel, double begin, double end,
            const std::function<void(std::vector<uint8_t>)>& use) const;

 private:
  [[noreturn]] void refuse(const std::string& channel) const;

  const std::string path_;
  int64_t size_ = 0;
  mutable std::once_flag once_;
  mutable Contents contents_;
};

const LogFile::Contents& LogFile::contents() const {
  std::call_once(once_, [this] {
    LogReader reader(path_);
    while (reader.next()) ++contents_.counts[reader.channel()];
    contents_.fault = reader.fault();
  });
  return contents_;
}

void LogFile::each(const std::string& channel, double begin, double end,
                   const std::function<void(std::vector<uint8_t>)>& use) const {
  LogReader reader(path_);
  if (reader.size() < size_) throw Error(path_ + ": it became shorter since it was opened");
  const int64_t begin_us = microseconds(begin), end_us = microseconds(end);
  if (begin_us > -kLatestLogTime_us) reader.seek_time(begin_us);
  bool found = false;
  while (reader.next() && reader.time_us() <= end_us) {
    if (reader.time_us() < begin_us || reader.channel() != channel) continue;
    found = true;
    use(reader.data());
  }
  if (!found && contents().counts.count(channel) == 0) refuse(channel);
}

void LogFile::refuse(const std::string& channel) const {
  std::string there;
  for (const auto& [name, count] : contents().counts) there += (there.empty() ? "" : ", ") + name;
  throw UnknownName(path_ + " has no channel '" + channel + "'; it has " +
                    (there.empty() ? "none" : there));
}

std::vector<std::string> Log::channels() const {
  std::vector<std::string> names;
  for (const auto& [name, count] : file_->contents().counts) names.push_back(name);
  return names;
}

size_t Log::count(const std::string& channel) const {
  const auto found = file_->contents().counts.find(channel);
  return found == file_->contents().counts.end() ? 0 : found->second;
}

const std::string& Log::fault() const { return file_->contents().fault; }

template <class SampleType>
void Log::each(const std::string& channel, const std::function<void(const SampleType&)>& use,
               double begin, double end) const {
  file_->each(channel, begin, end, [&](std::vector<uint8_t> bytes) {
    use(decoded<SampleType>(channel, std::move(bytes)));
  });
}

template <class SampleType>
std::vector<SampleType> Log::samples(const std::string& channel) const {
  std::vector<SampleType> samples;
  each<SampleType>(channel, [&](const SampleType& sample) { samples.push_back(sample); });
  return samples;
}

#define RUEDO_LOG_SAMPLES(SampleType, type)                                                  \
  template std::vector<SampleType> Log::samples(const std::string&) const;                   \
  template void Log::each(const std::string&, const std::function<void(const SampleType&)>&, \
                          double, double) const;
RUEDO_SAMPLE_TYPES(RUEDO_LOG_SAMPLES)
RUEDO_LOG_SAMPLES(RawSample, )
#undef RUEDO_LOG_SAMPLES

Log read_log(const std::string& path) { return Log(std::make_shared<const LogFile>(path)); }

}  // namespace ruedo::client
