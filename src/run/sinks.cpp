// The bus follows the announcements; the log tells its faults across threads.
#include "run/sinks.h"

#include "ruedo/errors.h"

namespace ruedo::run {
namespace {

constexpr std::chrono::milliseconds kLogLatency{200};

}  // namespace

void BusSink::listen(Bus::Handler handler) {
  listening_ = true;
  bus_.listen(inputs_, std::move(handler), outputs_);
}

void BusSink::announce(const std::shared_ptr<const Announcement>& announcement) {
  std::vector<std::string> inputs, outputs;
  for (const engine::Channel& channel : announcement->channels.list()) {
    if (!channel.gone) (channel.input ? inputs : outputs).push_back(channel.bus_name);
  }
  const bool same = inputs == inputs_ && outputs == outputs_;
  inputs_ = std::move(inputs);
  outputs_ = std::move(outputs);
  if (listening_ && !same) bus_.listen_to(inputs_, outputs_);
}

LogSink::LogSink(const std::string& path)
    : file_(path),
      queue_(file_,
             {.thread = "log", .when_full = QueuedSink::WhenFull::wait, .latency = kLogLatency}) {}

void LogSink::File::flush() {
  writer_.flush();
  if (writer_.error().empty()) return;
  const std::lock_guard lock(mutex_);
  error_ = writer_.error();
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
