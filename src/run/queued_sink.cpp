// The publisher fills a page; the queue's thread delivers the pages that were handed over.
#include "run/queued_sink.h"

#include <utility>

#include <pthread.h>

namespace ruedo::run {

QueuedSink::QueuedSink(Sink& sink, Options options)
    : sink_(sink), options_(std::move(options)), thread_([this] { work(); }) {}

QueuedSink::~QueuedSink() {
  if (!page_.entries.empty()) hand_over();
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

bool QueuedSink::has_room() {
  if (options_.when_full == WhenFull::wait) return true;
  return !full_ && page_.cost() <= options_.most_bytes;
}

QueuedSink::Entry& QueuedSink::add(What what) {
  if (page_.entries.empty()) page_begin_ = std::chrono::steady_clock::now();
  Entry& entry = page_.entries.emplace_back();
  entry.what = what;
  return entry;
}

// A sink that misses messages must still know which channels there are.
void QueuedSink::announce(const std::shared_ptr<const Announcement>& announcement) {
  add(What::announcement).announcement = announcement;
}

void QueuedSink::begin_step(const Step& step) {
  in_step_ = true;
  misses_step_ = !has_room();
  if (!misses_step_) add(What::begin).step = step;
}

void QueuedSink::message(const Published& message) {
  if (in_step_ && message.kind == Kind::sample ? misses_step_ : !has_room()) {
    ++missed_;
    return;
  }
  Entry& entry = add(What::message);
  entry.kind = message.kind;
  entry.time_us = message.time_us;
  entry.stamp_us = message.stamp_us;
  entry.channel = &*names_.insert(message.channel).first;
  entry.index = message.index;
  entry.sequence = message.sequence;
  entry.offset = page_.bytes.size();
  entry.size = message.size;
  page_.bytes.insert(page_.bytes.end(), message.data, message.data + message.size);
  if (page_.cost() >= kPageBytes) hand_over();
}

void QueuedSink::end_step(const Step& step) {
  if (!misses_step_) add(What::end).step = step;
  in_step_ = false;
}

void QueuedSink::flush() {
  if (page_.entries.empty()) return;
  if (page_.cost() < kPageBytes &&
      std::chrono::steady_clock::now() < page_begin_ + options_.latency)
    return;
  hand_over();
}

template <class Condition>
void QueuedSink::wait(std::unique_lock<std::mutex>& lock, Condition condition) {
  waited_for_ = true;
  changed_.wait(lock, condition);
  waited_for_ = false;
}

void QueuedSink::hand_over() {
  {
    std::unique_lock lock(mutex_);
    if (options_.when_full == WhenFull::wait)
      wait(lock, [this] { return bytes_ == 0 || bytes_ < options_.most_bytes; });
    bytes_ += page_.cost();
    full_ = bytes_ >= options_.most_bytes;
    pages_.push_back(std::move(page_));
    if (spare_.empty()) {
      page_ = {};
    } else {
      page_ = std::move(spare_.back());
      spare_.pop_back();
    }
  }
  changed_.notify_all();
}

void QueuedSink::drain() {
  if (!page_.entries.empty()) hand_over();
  std::unique_lock lock(mutex_);
  wait(lock, [this] { return bytes_ == 0; });
}

void QueuedSink::work() {
  pthread_setname_np(pthread_self(), options_.thread.c_str());
  for (;;) {
    Page page;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return over_ || !pages_.empty(); });
      if (pages_.empty()) return;
      page = std::move(pages_.front());
      pages_.pop_front();
    }
    deliver(page);
    const size_t cost = page.cost();
    page.clear();
    {
      const std::lock_guard lock(mutex_);
      bytes_ -= cost;
      full_ = bytes_ >= options_.most_bytes;
      spare_.push_back(std::move(page));
    }
    changed_.notify_all();
  }
}

void QueuedSink::deliver(const Page& page) {
  for (const Entry& entry : page.entries) {
    switch (entry.what) {
      case What::announcement: sink_.announce(entry.announcement); break;
      case What::begin: sink_.begin_step(entry.step); break;
      case What::end: sink_.end_step(entry.step); break;
      case What::message:
        sink_.message({entry.kind, entry.time_us, entry.stamp_us, *entry.channel, entry.index,
                       entry.sequence, page.bytes.data() + entry.offset, entry.size});
        break;
    }
  }
  sink_.flush();
}

}  // namespace ruedo::run
