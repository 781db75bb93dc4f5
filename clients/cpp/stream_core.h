// A subscription to one channel: the newest sample, its readers, and what went wrong.
//
// The receiving thread keeps the newest message undecoded. Readers decode it, and so does the
// thread of the callbacks.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "callbacks/callback_queue.h"
#include "callbacks/callbacks.h"
#include "ruedo/client.h"
#include "samples/sample_types.h"

namespace ruedo::client {

struct ChannelInfo;

// Thread safe. The connection has one for each requested channel; handles may outlive it.
class StreamCore : public std::enable_shared_from_this<StreamCore> {
 public:
  // decoder: null if the channel's type has no decoder. step_us: the simulation's. faults: of
  // callbacks.
  StreamCore(std::weak_ptr<Core> core, const ChannelInfo& channel, const SampleDecoder* decoder,
             int64_t step_us, const std::shared_ptr<CallbackFaults>& faults);

  const std::string& channel() const { return channel_; }
  const std::string& type() const { return type_; }
  // Where a new reader begins.
  int64_t last_read() const { return last_read_; }
  int64_t last_skipped() const { return last_skipped_; }
  int64_t queue_depth() const { return depth_; }
  void set_queue_depth(int64_t depth);  // of new readers; throws std::invalid_argument
  // seen, skipped: the reader's. depth: of the samples that it has not seen, the oldest among so
  // many newest, for which it waits; 0: the newest, seen or not. Throws Timeout, TypeMismatch,
  // NoServer.
  std::shared_ptr<const Sample> read(std::atomic<int64_t>& seen, std::atomic<int64_t>& skipped,
                                     int64_t depth, Duration timeout);
  struct Neighbours {
    std::shared_ptr<const Sample> before, after;  // the same where one is of the moment
  };
  // The samples around a time (us), once the stream has reached it. Nothing if it is older than
  // the kept samples. Throws as read() does.
  std::optional<Neighbours> around(int64_t utime, Duration timeout);
  int64_t kept_from();  // us; 0: nothing is kept
  void listen() { subscribe(*connection()); }
  int64_t missed() const { return *missed_; }  // by the callbacks
  Subscription on_sample(std::function<void(const Sample&)> callback);
  // The same in the receiving thread, for this library's own use.
  Subscription on_arrival(std::function<void(const Sample&)> callback);
  void forget();  // the samples are of a run that has ended
  void end();     // its robot is gone

 private:
  using Callbacks = CallbackList<const Sample&>;
  class Arrival;

  std::shared_ptr<Core> connection() const;  // throws NoServer once it was closed
  bool is_raw() const { return decoder_ == raw_decoder(); }
  void subscribe(Core& core);
  void on_message(const uint8_t* bytes, size_t size);
  void fail(std::exception_ptr fault);
  void keep(const std::shared_ptr<Arrival>& arrival);  // with the mutex held
  void call_back(Arrival& arrival);
  std::shared_ptr<const Sample> decoded(const std::vector<uint8_t>& bytes) const;
  int64_t lost_before(std::optional<int64_t> utime);
  std::shared_ptr<Arrival> unseen(int64_t seen, int64_t depth, int64_t not_before) const;
  void await(Core& core, std::unique_lock<std::mutex>& lock, Duration timeout,
             const std::function<bool()>& ready);
  TypeMismatch mismatch(int64_t fingerprint) const;
  int64_t announced(const Core& core) const;

  const std::weak_ptr<Core> core_;
  const std::string channel_, robot_, type_;
  const int64_t fingerprint_;      // as ruedo/info said first
  const double rate_, period_us_;  // 0: lost samples cannot be counted
  const SampleDecoder* decoder_;
  const std::shared_ptr<Callbacks> callbacks_;
  const std::shared_ptr<Callbacks> arrivals_ = std::make_shared<Callbacks>();
  const CallbackQueue::Count missed_ = std::make_shared<std::atomic<int64_t>>(0);

  std::mutex opening_;  // source_
  Subscription source_;
  std::mutex mutex_;  // what follows
  std::condition_variable news_;
  std::shared_ptr<Arrival> newest_;
  std::deque<std::shared_ptr<Arrival>> kept_;  // for around() and read(), the newest last
  size_t kept_bytes_ = 0;
  size_t least_kept_ = 1;  // the largest depth until now
  int64_t count_ = 0;      // samples that came or were lost
  std::optional<int64_t> last_utime_;
  std::vector<std::thread::id> waiting_;  // for a sample
  std::atomic<int64_t> last_read_{0}, last_skipped_{0}, depth_{1};
  std::exception_ptr fault_;
};

}  // namespace ruedo::client
