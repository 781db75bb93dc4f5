// The sinks of a server: the bus, the log, and watchers in the same process.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "log/ring.h"
#include "log/writer.h"
#include "ruedo/bus.h"
#include "run/queued_sink.h"
#include "run/sink.h"

namespace ruedo::run {

// The bus: the channels for clients, and the channels of their messages.
class BusSink : public Sink {
 public:
  // conflates: a client that falls behind gets the newest sample of each channel; else every one.
  BusSink(Bus& bus, bool conflates) : bus_(bus), conflates_(conflates) {}

  // From now on commands and requests come to the handler, in the bus's thread. Once, after the
  // first announcement.
  void listen(Bus::Handler handler);

  Hears hears() const override { return {.samples = true, .services = true}; }
  bool wants(const std::string& channel) const override { return bus_.is_heard(channel); }
  uint64_t audience() const override { return bus_.audience(); }
  void announce(const std::shared_ptr<const Announcement>& announcement) override;
  void message(const Published& message) override {
    bus_.publish(message.channel, message.data, message.size);
    if (message.kind == Kind::sample) bytes_ += message.size;
  }
  void flush() override { bus_.flush(); }

  uint64_t bytes() const { return bytes_; }  // of all samples

 private:
  Bus& bus_;
  const bool conflates_;
  bool listening_ = false;
  uint64_t bytes_ = 0;
  std::vector<std::string> inputs_, outputs_;
};

// A standard LCM log, written in a thread of its own. The run waits when the disk is slower than
// it: a log is whole.
class LogSink : public Sink {
 public:
  // limit: bytes of all files of a ring (log/ring.h); 0: one file without a limit.
  LogSink(const std::string& path, int64_t limit);
  // Makes the file, or empties that of an earlier run; before any message. Throws EnvironmentError
  // when that fails. wait: as log::Writer's.
  void begin(const std::function<void()>& wait) { file_.begin(wait); }

  Hears hears() const override { return queue_.hears(); }
  void begin_step(const Step& step) override { queue_.begin_step(step); }
  void message(const Published& message) override { queue_.message(message); }
  void end_step(const Step& step) override { queue_.end_step(step); }
  void flush() override { queue_.flush(); }

  // Whether the run waits for the disk. Any thread.
  bool waits() const { return queue_.is_waited_for(); }
  // Returns when all earlier messages were handed to the operating system.
  void drain() { queue_.drain(); }
  // After drain(), at the end of the run: check() then knows of a file that has gone.
  void look_for_file() { file_.look_for_file(); }
  // Throws EnvironmentError when the log cannot be written any more. now: sim time.
  void check(SimTime now) const;

 private:
  class File : public Sink {
   public:
    File(const std::string& path, int64_t limit) : path_(path), limit_(limit) {}
    void begin(const std::function<void()>& wait);
    Hears hears() const override { return {.samples = true, .records = true, .repeated = true}; }
    void begin_step(const Step&) override { step_begins_ = true; }
    void message(const Published& message) override;
    void flush() override;
    void look_for_file();
    std::string error() const;
    bool is_lost() const;
    const std::string& path() const { return path_; }

   private:
    void take_error();

    std::unique_ptr<log::Writer> writer_;  // one of the two, from begin() on
    std::unique_ptr<log::Ring> ring_;
    bool step_begins_ = false, told_ = false, told_unfollowed_ = false;
    const std::string path_;
    const int64_t limit_;
    std::chrono::steady_clock::time_point looked_{};
    mutable std::mutex mutex_;
    std::string error_;
    bool lost_ = false;
  };

  File file_;
  QueuedSink queue_;
};

// Sees each message as a log would get it.
using Watcher = std::function<void(SimTime stamp, const std::string& channel, const uint8_t* data,
                                   size_t size)>;

class WatcherSink : public Sink {
 public:
  explicit WatcherSink(Watcher watcher) : watcher_(std::move(watcher)) {}
  Hears hears() const override { return {.samples = true, .records = true, .repeated = true}; }
  void message(const Published& message) override {
    watcher_(message.stamp_us, message.channel, message.data, message.size);
  }

 private:
  const Watcher watcher_;
};

}  // namespace ruedo::run
