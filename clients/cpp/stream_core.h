// A subscription to one channel: the newest sample, its readers, and what went wrong.
#pragma once

#include <atomic>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "callbacks.h"
#include "ruedo/client.h"
#include "sample_types.h"

namespace ruedo::client {

struct ChannelInfo;

// Thread safe. The connection has one for each channel that was asked for; handles may outlive it.
class StreamCore : public std::enable_shared_from_this<StreamCore> {
 public:
  // decoder: null where there is none for the channel's type.
  StreamCore(std::weak_ptr<Core> core, const ChannelInfo& channel, const SampleDecoder* decoder);

  const std::string& channel() const { return channel_; }
  const std::string& type() const { return type_; }
  int64_t last_read() const { return last_read_; }  // where a new reader begins
  // seen: the reader's. new_one: waits for a sample that it has not seen. Throws Timeout,
  // TypeMismatch, NoServer.
  std::shared_ptr<const Sample> read(std::atomic<int64_t>& seen, bool new_one, Duration timeout);
  Subscription on_sample(std::function<void(const Sample&)> callback);
  void forget();  // what came is of a run that has ended
  void end();     // its robot is gone

 private:
  using Callbacks = CallbackList<const Sample&>;

  std::shared_ptr<Core> connection() const;  // throws NoServer once it was closed
  bool is_raw() const { return decoder_ == raw_decoder(); }
  void subscribe(Core& core);
  void receive(const uint8_t* bytes, size_t size);
  TypeMismatch mismatch(int64_t fingerprint) const;
  int64_t announced(const Core& core) const;

  const std::weak_ptr<Core> core_;
  const std::string channel_, robot_, type_;
  const int64_t fingerprint_;  // as ruedo/info said first
  const double rate_;
  const SampleDecoder* decoder_;
  const std::shared_ptr<Callbacks> callbacks_ = std::make_shared<Callbacks>();

  std::mutex opening_;  // source_
  Subscription source_;
  std::mutex mutex_;  // what follows
  std::condition_variable news_;
  std::shared_ptr<const Sample> sample_;
  int64_t count_ = 0;  // samples received
  std::atomic<int64_t> last_read_{0};
  std::exception_ptr fault_;
};

}  // namespace ruedo::client
