// The bus follows the announcements; the log tells its faults across threads.
#include "run/sinks.h"

#include <utility>

#include <spdlog/spdlog.h>

#include "base/channel_names.h"
#include "ruedo/errors.h"

namespace ruedo::run {
namespace {

constexpr std::chrono::milliseconds kLogLatency{200};

}  // namespace

void BusSink::listen(Bus::Handler handler) {
  listening_ = true;
  bus_.listen(inputs_, std::move(handler), outputs_);
}

// Answers are asked for once, and of what goes in parts the last part replaces nothing.
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

void LogSink::File::begin() {
  if (limit_ > 0)
    ring_ = std::make_unique<log::Ring>(path_, limit_);
  else
    writer_ = std::make_unique<log::Writer>(path_);
}

void LogSink::File::message(const Published& message) {
  if (writer_) return writer_->write(message.stamp_us, message.channel, message.data, message.size);
  if (std::exchange(step_begins_, false)) ring_->begin_step(message.stamp_us);
  ring_->write(message.stamp_us, message.channel, message.data, message.size,
               message.kind == Kind::record);
}

void LogSink::File::flush() {
  ring_ ? ring_->flush() : writer_->flush();
  const std::string& error = ring_ ? ring_->error() : writer_->error();
  if (ring_ && !ring_->repeats() && !std::exchange(told_, true))
    spdlog::warn(
        "what acted on the run takes half of --record-limit: {} repeats it up to here, and no "
        "further",
        path_);
  if (ring_ && !ring_->follows() && !std::exchange(told_unfollowed_, true))
    spdlog::warn(
        "what changed the world takes more than a sixteenth of --record-limit: the numbered files "
        "beside {} begin without what came after it",
        path_);
  if (error.empty()) return;
  const std::lock_guard lock(mutex_);
  error_ = error;
}

std::string LogSink::File::error() const {
  const std::lock_guard lock(mutex_);
  return error_;
}

void LogSink::check(SimTime now) const {
  const std::string error = file_.error();
  if (error.empty()) return;
  throw EnvironmentError("--record: " + file_.path() + ": " + error +
                         ". The log is readable up to " + std::to_string(now / 1000000) +
                         " s of sim time: make room, or record elsewhere");
}

}  // namespace ruedo::run
