// Two writers: one for what acted, one for the file that is being filled.
#include "log/ring.h"

#include <array>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "base/big_endian.h"
#include "base/input_file.h"
#include "base/lcm_log.h"
#include "log/header.h"
#include "log/index.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/decode.h"
#include "ruedo/errors.h"

namespace ruedo::log {
namespace {

namespace fs = std::filesystem;

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

// The number of the first event of a numbered file. Other logs begin with 0: by this it is known
// what a ring has written, and what only looks so by its name, as run.091500.lcm does.
int64_t first_event_of(int64_t number) { return number << 32; }

// A file of that name that a ring has written.
bool is_of_ring(const fs::path& file, int64_t number) {
  std::array<uint8_t, kLogHeadSize> head{};
  std::error_code error;
  if (number == 0 || !fs::is_regular_file(fs::symlink_status(file, error))) return false;
  try {
    const InputFile in = open_to_look(file.string());
    return std::fread(head.data(), 1, head.size(), in.file.get()) == head.size() &&
           read_big_endian<uint32_t>(head.data()) == kLogSync &&
           read_big_endian<int64_t>(head.data() + sizeof kLogSync) == first_event_of(number);
  } catch (const InputError&) {
    return false;
  }
}

// Only what a ring of that name has written: run.000001.lcm of run.lcm.
void remove_numbered(const fs::path& path) {
  const std::string stem = path.stem().string(), suffix = path.extension().string();
  std::error_code error;
  std::vector<fs::path> found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_of(path), error)) {
    const std::string name = entry.path().filename().string();
    if (name.size() != stem.size() + suffix.size() + 7 || !name.starts_with(stem + ".") ||
        !name.ends_with(suffix))
      continue;
    const std::string number = name.substr(stem.size() + 1, 6);
    if (number.find_first_not_of("0123456789") == std::string::npos &&
        is_of_ring(entry.path(), std::stoll(number)))
      found.push_back(entry.path());
  }
  for (const fs::path& old : found) fs::remove(old, error);
}

}  // namespace

Ring::Ring(const std::string& path, int64_t limit, const std::function<void()>& wait)
    : path_(path), limit_(limit), acted_(path, wait) {
  remove_numbered(path);
}

std::string Ring::name_of(int64_t number) const {
  const fs::path path(path_);
  return (path.parent_path() /
          fmt::format("{}.{:06}{}", path.stem().string(), number, path.extension().string()))
      .string();
}

void Ring::begin_file(int64_t timestamp_us) {
  if (file_) {
    file_->flush();
    full_.push_back({file_->path(), file_->size()});
    full_bytes_ += file_->size();
  }
  try {
    std::error_code error;
    do {  // what is there by now is others'
      ++number_;
    } while (fs::exists(fs::symlink_status(name_of(number_), error)));
    file_ = std::make_unique<Writer>(name_of(number_));
    file_->number_from(first_event_of(number_));
  } catch (const EnvironmentError& fault) {
    file_.reset();
    error_ = fault.what();
    return;
  }
  for (const Event& event : preamble_)
    file_->write(timestamp_us, event.channel, event.data.data(), event.data.size());
  remove_old();
}

void Ring::remove_old() {
  const int64_t next = limit_ / kFiles;  // room for the file that begins
  while (!full_.empty() && acted_.size() + full_bytes_ + next > limit_) {
    std::error_code error;
    fs::remove(full_.front().path, error);
    full_bytes_ -= full_.front().size;
    full_.pop_front();
  }
}

void Ring::begin_step(int64_t timestamp_us) {
  if (error_.empty() && (!file_ || file_->size() >= limit_ / kFiles)) begin_file(timestamp_us);
}

void Ring::write(int64_t timestamp_us, const std::string& channel, const uint8_t* data, size_t size,
                 bool record) {
  if (!error_.empty()) return;
  if (record && repeats_) {
    acted_.write(timestamp_us, channel, data, size);
    repeats_ = acted_.size() <= limit_ / 2;
  }
  if (record) keep_for_later(channel, data, size);
  if (file_) file_->write(timestamp_us, channel, data, size);
}

// Headers, and the requests that changed the world, as the console and `export` follow them.
void Ring::keep_for_later(const std::string& channel, const uint8_t* data, size_t size) {
  applied_t applied;
  if (!follows_ ||
      (channel != kHeaderChannel &&
       (channel != kAppliedChannel || decode_checked(data, size, applied) != DecodeFault::none ||
        !changes_world(applied.kind))))
    return;
  if (!preamble_.empty()) preamble_bytes_ += static_cast<int64_t>(size);  // but the first header
  follows_ = preamble_.size() < 2 * Index::kMostEdits && preamble_bytes_ <= limit_ / kPreambleShare;
  if (follows_) preamble_.push_back({channel, {data, data + size}});
}

void Ring::look_for_files() {
  acted_.look_for_file();
  if (file_) file_->look_for_file();
  take_errors();
}

void Ring::flush() {
  acted_.flush();
  if (file_) file_->flush();
  take_errors();
}

void Ring::take_errors() {
  if (error_.empty()) error_ = acted_.error();
  if (error_.empty() && file_) error_ = file_->error();
}

}  // namespace ruedo::log
