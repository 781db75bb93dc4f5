// Reading logs (base/lcm_log.h): where each message lies is found once, and the messages are read
// when asked for.
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>

#include "base/big_endian.h"
#include "base/lcm_log.h"
#include "base/message_size.h"
#include "samples/sample_types.h"

namespace ruedo::client {
namespace {

constexpr auto kHeadSize = static_cast<int64_t>(kLogHeadSize);
constexpr int64_t kLongestChannel = 1000;

}  // namespace

class LogFile {
 public:
  explicit LogFile(std::string path);

  struct Place {
    int64_t offset;  // of the data
    size_t size;
  };
  const std::map<std::string, std::vector<Place>>& places() const { return places_; }
  const std::string& fault() const { return fault_; }
  std::vector<uint8_t> read(const Place& place) const;             // throws Error
  const std::vector<Place>& of(const std::string& channel) const;  // throws UnknownName

 private:
  bool add_event(int64_t begin, int64_t& next);

  const std::string path_;
  mutable std::mutex mutex_;  // of the file's position
  mutable std::ifstream file_;
  int64_t size_ = 0;
  std::map<std::string, std::vector<Place>> places_;
  std::string fault_;
};

LogFile::LogFile(std::string path) : path_(std::move(path)) {
  std::error_code error;
  const bool regular = std::filesystem::is_regular_file(path_, error);
  if (regular) file_.open(path_, std::ios::binary);  // opening a FIFO would wait for its writer
  if (!regular || !file_) {
    const bool there = std::filesystem::exists(path_, error);
    throw Error(path_ + (there ? ": it is not a file that can be read" : ": no such file"));
  }
  size_ = static_cast<int64_t>(std::filesystem::file_size(path_));
  int64_t next = 0;
  for (int64_t begin = 0; begin < size_ && add_event(begin, next); begin = next) {
  }
  if (!fault_.empty() && next == 0) throw Error(path_ + ": it is not an LCM log: " + fault_);
}

// False where the log was cut off, or is damaged.
bool LogFile::add_event(int64_t begin, int64_t& next) {
  std::array<uint8_t, kHeadSize> head{};
  const auto wrong = [&](const char* what) {
    fault_ = what + std::to_string(begin);
    return false;
  };
  constexpr const char* kCutOff = "it was cut off in the event that begins at byte ";
  file_.seekg(begin);
  file_.read(reinterpret_cast<char*>(head.data()), kHeadSize);
  if (file_.gcount() < 4) return wrong(kCutOff);
  if (read_big_endian<uint32_t>(head.data()) != kLogSync) return wrong("it is damaged at byte ");
  if (file_.gcount() < kHeadSize) return wrong(kCutOff);
  const int64_t name_size = read_big_endian<uint32_t>(&head[20]),
                size = read_big_endian<uint32_t>(&head[24]);
  if (name_size > kLongestChannel || size > int64_t{kLargestMessage})
    return wrong("it is damaged at byte ");
  // A false length must not exhaust the memory.
  if (begin + kHeadSize + name_size + size > size_) return wrong(kCutOff);
  std::string name(static_cast<size_t>(name_size), '\0');
  file_.read(name.data(), name_size);
  next = begin + kHeadSize + name_size + size;
  places_[name].push_back({begin + kHeadSize + name_size, static_cast<size_t>(size)});
  return true;
}

std::vector<uint8_t> LogFile::read(const Place& place) const {
  std::vector<uint8_t> bytes(place.size);
  const std::lock_guard lock(mutex_);
  file_.clear();
  file_.seekg(place.offset);
  if (!file_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(place.size)))
    throw Error(path_ + ": it became shorter since it was opened");
  return bytes;
}

const std::vector<LogFile::Place>& LogFile::of(const std::string& channel) const {
  const auto found = places_.find(channel);
  if (found != places_.end()) return found->second;
  std::string there;
  for (const auto& [name, places] : places_) there += (there.empty() ? "" : ", ") + name;
  throw UnknownName(path_ + " has no channel '" + channel + "'; it has " +
                    (there.empty() ? "none" : there));
}

std::vector<std::string> Log::channels() const {
  std::vector<std::string> names;
  for (const auto& [name, places] : file_->places()) names.push_back(name);
  return names;
}

size_t Log::count(const std::string& channel) const {
  const auto found = file_->places().find(channel);
  return found == file_->places().end() ? 0 : found->second.size();
}

const std::string& Log::fault() const { return file_->fault(); }

template <class SampleType>
std::vector<SampleType> Log::samples(const std::string& channel) const {
  std::vector<SampleType> samples;
  for (const LogFile::Place& place : file_->of(channel))
    samples.push_back(decoded<SampleType>(channel, file_->read(place)));
  return samples;
}

#define RUEDO_LOG_SAMPLES(SampleType, type) \
  template std::vector<SampleType> Log::samples(const std::string&) const;
RUEDO_SAMPLE_TYPES(RUEDO_LOG_SAMPLES)
RUEDO_LOG_SAMPLES(RawSample, )
#undef RUEDO_LOG_SAMPLES

Log read_log(const std::string& path) { return Log(std::make_shared<const LogFile>(path)); }

}  // namespace ruedo::client
