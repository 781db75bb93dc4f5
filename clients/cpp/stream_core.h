// A subscription to one channel: the newest sample, those who wait for it, and what went wrong.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "ruedo/client.h"
#include "sample_types.h"

namespace ruedo::client {

struct ChannelInfo;

// Thread safe. Lives as long as its connection, which outlives every call.
class StreamCore {
 public:
  StreamCore(Core& core, const ChannelInfo& channel);

  const std::string& channel() const { return channel_; }
  const std::string& type() const { return type_; }
  std::shared_ptr<const Sample> latest(double timeout);
  std::shared_ptr<const Sample> next(double timeout);
  void on_sample(std::function<void(const Sample&)> callback);

  std::shared_ptr<Core> owner() const;    // keeps the connection while a handle is in use

 private:
  void subscribe();
  void receive(const uint8_t* bytes, size_t size);
  std::shared_ptr<const Sample> wait(bool new_one, double timeout);
  TypeMismatch mismatch(int64_t fingerprint) const;

  Core& core_;
  const std::string channel_, type_;
  const int64_t fingerprint_;    // as ruedo/info says
  const double rate_;
  const SampleDecoder* decoder_;

  std::mutex mutex_;
  std::condition_variable news_;
  bool open_ = false;
  std::shared_ptr<const Sample> sample_;
  int64_t count_ = 0;    // samples received
  int64_t seen_ = 0;     // of those, the newest that a call has returned
  std::exception_ptr fault_;
  std::vector<std::function<void(const Sample&)>> callbacks_;
};

}  // namespace ruedo::client
