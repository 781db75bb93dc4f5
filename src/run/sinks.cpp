// The bus follows the announcements; the log reports its faults across threads.
#include "run/sinks.h"

#include <utility>

#include <spdlog/spdlog.h>

#include "base/channel_names.h"
#include "ruedo/errors.h"

namespace ruedo::run {
namespace {

constexpr std::chrono::milliseconds kLogLatency{200};
constexpr std::chrono::seconds kBetweenLooks{1};  // for the log's file

}  // namespace

void BusSink::listen(Bus::Handler handler) {
  listening_ = true;
  bus_.listen(inputs_, std::move(handler), outputs_);
}

// Answers are requested once; a last part of a message replaces nothing.
bool is_conflated(const engine::Channel& channel, const engine::SimulationChannels& own,
                  engine::ChannelIndex index) {
  return !channel.input && index != own.reply && index != own.info && channel.name != kWorldChannel;
}

void BusSink::announce(const std::shared_ptr<const Announcement>& announcement) {
  std::vector<std::string> inputs, outputs, conflated;
  for (const engine::ChannelIndex index : announcement->channels.list().indices()) {
    const engine::Channel& channel = announcement->channels[index];
    if (channel.gone) continue;
    (channel.input ? inputs : outputs).push_back(channel.bus_name);
    if (is_conflated(channel, announcement->own, index)) conflated.push_back(channel.bus_name);
  }
  if (conflates_) bus_.conflate(conflated);
  const bool same = inputs == inputs_ && outputs == outputs_;
  inputs_ = std::move(inputs);
  outputs_ = std::move(outputs);
  if (listening_ && !same) bus_.listen_to(inputs_, outputs_);
}

LogSink::LogSink(const std::string& path, int64_t limit)
    : file_(path, limit),
      queue_(file_,
             {.thread = "log", .when_full = QueuedSink::WhenFull::wait, .latency = kLogLatency}) {}

void LogSink::File::begin(const std::function<void()>& wait) {
  if (limit_ > 0)
    ring_ = std::make_unique<log::Ring>(path_, limit_, wait);
  else
    writer_ = std::make_unique<log::Writer>(path_, wait);
}

void LogSink::File::message(const Published& message) {
  if (writer_) return writer_->write(message.stamp_us, message.channel, message.data, message.size);
  if (std::exchange(step_begins_, false)) ring_->begin_step(message.stamp_us);
  ring_->write(message.stamp_us, message.channel, message.data, message.size,
               message.kind == Kind::record);
}

void LogSink::File::flush() {
  ring_ ? ring_->flush() : writer_->flush();
  const auto now = std::chrono::steady_clock::now();
  if (now >= looked_ + kBetweenLooks) {
    looked_ = now;
    look_for_file();
  } else {
    take_error();
  }
  if (ring_ && !ring_->repeats() && !std::exchange(told_, true))
    spdlog::warn(
        "commands and requests take half of --record-limit: {} repeats the run up to here only",
        path_);
  if (ring_ && !ring_->follows() && !std::exchange(told_unfollowed_, true))
    spdlog::warn(
        "changes of the world take more than a sixteenth of --record-limit: the numbered files "
        "beside {} begin without the later ones",
        path_);
}

void LogSink::File::look_for_file() {
  ring_ ? ring_->look_for_files() : writer_->look_for_file();
  take_error();
}

void LogSink::File::take_error() {
  const std::string& error = ring_ ? ring_->error() : writer_->error();
  if (error.empty()) return;
  const std::lock_guard lock(mutex_);
  error_ = error;
  lost_ = ring_ ? ring_->is_lost() : writer_->is_lost();
}

bool LogSink::File::is_lost() const {
  const std::lock_guard lock(mutex_);
  return lost_;
}

std::string LogSink::File::error() const {
  const std::lock_guard lock(mutex_);
  return error_;
}

void LogSink::check(SimTime now) const {
  const std::string error = file_.error();
  if (error.empty()) return;
  if (file_.is_lost()) throw EnvironmentError("--record: " + file_.path() + ": " + error);
  throw EnvironmentError("--record: " + file_.path() + ": " + error +
                         ". The log is readable up to " + std::to_string(now / 1000000) +
                         " s of sim time: make room, or record elsewhere");
}

}  // namespace ruedo::run
