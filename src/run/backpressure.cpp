#include "run/backpressure.h"

#include <algorithm>
#include <charconv>

namespace ruedo::run {

std::optional<LauncherProgress> read_launcher_progress(std::string_view line) {
  LauncherProgress progress;
  const char* at = line.data();
  const char* const end = at + line.size();
  const auto read = [&](auto& number) {
    while (at != end && *at == ' ') ++at;
    const auto [next, error] = std::from_chars(at, end, number);
    at = next;
    return error == std::errc{};
  };
  const bool is_whole =
      read(progress.epoch) && read(progress.received_us) && read(progress.used_us) && at == end;
  return is_whole ? std::optional(progress) : std::nullopt;
}

void Backpressure::note_progress(const LauncherProgress& progress) {
  const std::lock_guard lock(mutex_);
  acts_ = true;
  if (progress.epoch != progress_.epoch) return;
  progress_ = progress;
  while (!on_the_way_.empty() && on_the_way_.front().time_us <= progress.received_us) {
    received_ = on_the_way_.front().bytes;
    on_the_way_.pop_front();
  }
}

void Backpressure::end() {
  const std::lock_guard lock(mutex_);
  acts_ = false;
  on_the_way_.clear();
}

void Backpressure::begin(int32_t epoch, SimTime time_us) {
  const std::lock_guard lock(mutex_);
  progress_ = {epoch, time_us};
  on_the_way_.clear();
  received_ = published_;
}

Backpressure::Limits Backpressure::limits() const {
  const std::lock_guard lock(mutex_);
  if (!acts_) return {};
  const auto after = [this](SimTime time_us, SimTime ahead_us) {
    if (time_us > std::numeric_limits<SimTime>::max() / 2)
      return std::numeric_limits<int64_t>::max();
    return std::max(time_us, SimTime{0}) / step_us_ + std::max<int64_t>(ahead_us / step_us_, 1);
  };
  return {after(progress_.received_us, kMostAhead), after(progress_.used_us, kMostAhead / 2)};
}

void Backpressure::published(SimTime time_us, uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  published_ = bytes;
  if (acts_) on_the_way_.push_back({time_us, bytes});
}

bool Backpressure::has_room() const {
  const std::lock_guard lock(mutex_);
  return on_the_way_.empty() || on_the_way_.back().bytes - received_ <= kMostBytes;
}

}  // namespace ruedo::run
