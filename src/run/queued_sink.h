// A sink behind a bounded queue: what it hears is copied, and handed to the sink in a thread of its
// own.
//
// Messages travel in pages, so that a queue costs a lock and a wake-up for many of them, and the
// pages' memory is used again. When the sink is slower than the run, the run waits for it (a log,
// which must be whole), or the sink misses whole steps (for onlookers, which must not slow
// the run).
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_set>
#include <vector>

#include "run/sink.h"

namespace ruedo::run {

class QueuedSink : public Sink {
 public:
  enum class WhenFull { wait, miss };
  struct Options {
    std::string thread;  // its name, at most 15 characters
    WhenFull when_full = WhenFull::miss;
    size_t most_bytes = size_t{16} << 20;  // in the queue
    std::chrono::milliseconds latency{0};  // that a message may wait for others to travel with
  };

  // The sink must outlive it, and is called from the queue's thread only, except for hears(),
  // wants() and audience().
  QueuedSink(Sink& sink, Options options);
  ~QueuedSink() override;  // delivers what is queued, then ends the thread

  Hears hears() const override { return sink_.hears(); }
  bool wants(const std::string& channel) const override { return sink_.wants(channel); }
  uint64_t audience() const override { return sink_.audience(); }
  void announce(const std::shared_ptr<const Announcement>& announcement) override;
  void begin_step(const Step& step) override;
  void message(const Published& message) override;
  void end_step(const Step& step) override;
  void flush() override;

  // Returns when the sink has received and flushed all earlier messages.
  void drain();

  // Whether the run waits for the sink at this moment. Any thread, as the next.
  bool is_waited_for() const { return waited_for_; }
  // Messages that found no room.
  uint64_t missed() const { return missed_; }

 private:
  enum class What { announcement, begin, message, end };
  struct Entry {
    What what;
    Kind kind = Kind::sample;
    Step step{};
    SimTime time_us = 0, stamp_us = 0;
    const std::string* channel = nullptr;
    engine::ChannelIndex index;
    int64_t sequence = 0;
    size_t offset = 0, size = 0;
    std::shared_ptr<const Announcement> announcement;
  };
  struct Page {
    std::vector<Entry> entries;
    std::vector<uint8_t> bytes;
    size_t cost() const { return bytes.size() + entries.size() * sizeof(Entry); }
    void clear() {
      entries.clear();
      bytes.clear();
    }
  };
  static constexpr size_t kPageBytes = size_t{64} << 10;  // a page with more is handed over at once

  bool has_room();
  Entry& add(What what);
  void hand_over();
  template <class Condition>
  void wait(std::unique_lock<std::mutex>& lock, Condition condition);
  void work();
  void deliver(const Page& page);

  Sink& sink_;
  const Options options_;

  // For the publisher's thread alone.
  Page page_;
  std::chrono::steady_clock::time_point page_begin_;
  bool in_step_ = false, misses_step_ = false;
  std::unordered_set<std::string>
      names_;  // of channels; they stay where they are while others come

  std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::deque<Page> pages_;
  std::vector<Page> spare_;
  size_t bytes_ = 0;  // of the pages, and of the one that is being delivered
  bool over_ = false;
  std::atomic<bool> full_{false}, waited_for_{false};
  std::atomic<uint64_t> missed_{0};
  std::thread thread_;
};

}  // namespace ruedo::run
