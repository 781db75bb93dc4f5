// Streams: subscription, waiting, and the typed faces of both.
#include "stream_core.h"

#include <cstdio>
#include <utility>

#include "core.h"

namespace ruedo::client {
namespace {

std::string hex(int64_t fingerprint) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(fingerprint));
  return text;
}

}  // namespace

StreamCore::StreamCore(std::weak_ptr<Core> core, const ChannelInfo& channel,
                       const SampleDecoder* decoder)
    : core_(std::move(core)),
      channel_(channel.name),
      robot_(channel.robot),
      type_(channel.type),
      fingerprint_(channel.fingerprint),
      rate_(channel.rate),
      decoder_(decoder) {}

std::shared_ptr<Core> StreamCore::connection() const {
  auto core = core_.lock();
  if (!core) throw NoServer(kClosed);
  core->check_open();
  return core;
}

Subscription StreamCore::on_sample(std::function<void(const Sample&)> callback) {
  subscribe(*connection());
  return Subscription(callbacks_->add(channel_, std::move(callback)));
}

TypeMismatch StreamCore::mismatch(int64_t fingerprint) const {
  const auto core = core_.lock();
  return TypeMismatch(channel_ + " carries another version of " + type_ + " (fingerprint " +
                      hex(fingerprint) + ") than this client reads (" + hex(decoder_->fingerprint) +
                      ")" +
                      (core ? ": the server is Ruedo " + core->info()->version +
                                  "; use the client of the same version"
                            : ""));
}

void StreamCore::subscribe(Core& core) {
  const std::lock_guard lock(opening_);
  if (source_.open()) return;
  if (!decoder_)
    throw TypeMismatch(channel_ + " carries " + type_ +
                       ", of which this client has no samples: robot.stream<" + type_ +
                       ">() takes the class that lcm-gen made of its .lcm file");
  if (const int64_t fingerprint = announced(core);
      !is_raw() && fingerprint != decoder_->fingerprint)
    throw mismatch(fingerprint);
  source_ =
      core.bus().subscribe(channel_, [self = weak_from_this()](const uint8_t* bytes, size_t size) {
        if (const auto stream = self.lock()) stream->receive(bytes, size);
      });
}

// The fingerprint by the newest info: one before may have been false, or of another server.
int64_t StreamCore::announced(const Core& core) const {
  const auto info = core.info();
  if (const auto found = info->channels.find(robot_); found != info->channels.end()) {
    for (const ChannelInfo& channel : found->second)
      if (channel.name == channel_) return channel.fingerprint;
  }
  return fingerprint_;
}

void StreamCore::forget() {
  const std::lock_guard lock(mutex_);
  sample_ = nullptr;
  fault_ = nullptr;
}

void StreamCore::end() {
  Subscription source;
  {
    const std::lock_guard lock(opening_);
    source = std::move(source_);
  }
}

void StreamCore::receive(const uint8_t* bytes, size_t size) {
  if (const auto core = core_.lock(); core && (core->closed() || core->in_doubt())) return;
  std::shared_ptr<const Sample> sample;
  std::exception_ptr fault;
  try {
    WireReader in(bytes, size);
    const int64_t fingerprint = in.int64();
    if (!is_raw() && fingerprint != decoder_->fingerprint) throw mismatch(fingerprint);
    sample = decoder_->decode(in);
  } catch (const WireError& error) {
    fault =
        std::make_exception_ptr(TypeMismatch(channel_ + ": a message of " + std::to_string(size) +
                                             " bytes is no valid " + type_ + ": " + error.what()));
  } catch (const TypeMismatch&) {
    fault = std::current_exception();
  }
  {
    const std::lock_guard lock(mutex_);
    fault_ = fault;
    if (sample) {
      sample_ = sample;
      ++count_;
    }
  }
  news_.notify_all();
  if (!sample) return;
  if (const auto core = core_.lock(); core && !is_raw()) core->note_time(sample->utime);
  callbacks_->call(*sample);
}

std::shared_ptr<const Sample> StreamCore::read(std::atomic<int64_t>& seen, bool new_one,
                                               Duration timeout) {
  const auto core = connection();
  subscribe(*core);
  const Clock::time_point deadline = deadline_after(timeout);
  std::unique_lock lock(mutex_);
  while (!sample_ || (new_one && count_ == seen)) {
    if (fault_) std::rethrow_exception(std::exchange(fault_, nullptr));
    core->check_may_wait();
    if (Clock::now() >= deadline) {
      throw Timeout("no sample on " + channel_ + " within " + text_of(timeout) + " s (" +
                    core->what_is_known(rate_) + ")");
    }
    news_.wait_until(lock, std::min(deadline, Clock::now() + std::chrono::milliseconds(500)));
    core->check_server();
  }
  last_read_ = seen = count_;
  return sample_;
}

template <class SampleType>
Stream<SampleType>::Stream(std::shared_ptr<StreamCore> core)
    : core_(std::move(core)), seen_(core_->last_read()) {}

template <class SampleType>
const std::string& Stream<SampleType>::channel() const {
  return core_->channel();
}

template <class SampleType>
SampleType Stream<SampleType>::latest(Duration timeout) const {
  return static_cast<const SampleType&>(*core_->read(seen_, false, timeout));
}

template <class SampleType>
SampleType Stream<SampleType>::next(Duration timeout) const {
  return static_cast<const SampleType&>(*core_->read(seen_, true, timeout));
}

template <class SampleType>
Subscription Stream<SampleType>::on_sample(std::function<void(const SampleType&)> callback) const {
  if (!callback) return core_->on_sample({});
  return core_->on_sample([callback = std::move(callback)](const Sample& sample) {
    callback(static_cast<const SampleType&>(sample));
  });
}

#define RUEDO_STREAM(SampleType, type) template class Stream<SampleType>;
RUEDO_SAMPLE_TYPES(RUEDO_STREAM)
#undef RUEDO_STREAM
template class Stream<RawSample>;

}  // namespace ruedo::client
