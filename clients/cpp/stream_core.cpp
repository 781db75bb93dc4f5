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

StreamCore::StreamCore(Core& core, const ChannelInfo& channel)
    : core_(core), channel_(channel.name), type_(channel.type), fingerprint_(channel.fingerprint), rate_(channel.rate),
      decoder_(find_decoder(channel.type)) {}

std::shared_ptr<Core> StreamCore::owner() const { return core_.shared_from_this(); }

std::shared_ptr<const Sample> StreamCore::latest(double timeout) { return wait(false, timeout); }
std::shared_ptr<const Sample> StreamCore::next(double timeout) { return wait(true, timeout); }

void StreamCore::on_sample(std::function<void(const Sample&)> callback) {
  {
    std::lock_guard lock(mutex_);
    callbacks_.push_back(std::move(callback));
  }
  subscribe();
}

TypeMismatch StreamCore::mismatch(int64_t fingerprint) const {
  return TypeMismatch(channel_ + " carries another version of " + type_ + " (fingerprint " + hex(fingerprint) +
                      ") than this client reads (" + hex(decoder_->fingerprint) + "): the server is Ruedo " +
                      core_.info()->version + "; use the client of the same version");
}

void StreamCore::subscribe() {
  {
    std::lock_guard lock(mutex_);
    if (open_) return;
    if (!decoder_) throw TypeMismatch(channel_ + ": this client does not know the type " + type_);
    if (fingerprint_ != decoder_->fingerprint) throw mismatch(fingerprint_);
    open_ = true;
  }
  core_.bus().subscribe(channel_, [this](const uint8_t* bytes, size_t size) { receive(bytes, size); });
}

void StreamCore::receive(const uint8_t* bytes, size_t size) {
  std::shared_ptr<const Sample> sample;
  std::exception_ptr fault;
  try {
    WireReader in(bytes, size);
    const int64_t fingerprint = in.int64();
    if (fingerprint != decoder_->fingerprint) throw mismatch(fingerprint);
    sample = decoder_->decode(in);
  } catch (const WireError& error) {
    fault = std::make_exception_ptr(TypeMismatch(channel_ + ": a message of " + std::to_string(size) + " bytes is no valid " +
                                                 type_ + ": " + error.what()));
  } catch (const TypeMismatch&) {
    fault = std::current_exception();
  }
  std::vector<std::function<void(const Sample&)>> callbacks;
  {
    std::lock_guard lock(mutex_);
    fault_ = fault;
    if (sample) {
      sample_ = sample;
      ++count_;
      callbacks = callbacks_;
    }
  }
  news_.notify_all();
  if (!sample) return;
  core_.note_time(sample->utime);
  for (const auto& callback : callbacks) {
    try {
      callback(*sample);
    } catch (const std::exception& error) {    // the receiving thread lives on
      std::fprintf(stderr, "ruedo: a callback on %s failed: %s\n", channel_.c_str(), error.what());
    }
  }
}

std::shared_ptr<const Sample> StreamCore::wait(bool new_one, double timeout) {
  subscribe();
  const Clock::time_point deadline = deadline_after(timeout);
  std::unique_lock lock(mutex_);
  while (new_one ? count_ == seen_ : count_ == 0) {
    if (fault_) std::rethrow_exception(std::exchange(fault_, nullptr));
    if (Clock::now() >= deadline) {
      char text[32];
      std::snprintf(text, sizeof text, "%g", timeout);
      throw Timeout("no sample on " + channel_ + " within " + text + " s (" + core_.what_is_known(rate_) + ")");
    }
    news_.wait_until(lock, std::min(deadline, Clock::now() + std::chrono::milliseconds(500)));
    core_.check_server();
  }
  seen_ = count_;
  return sample_;
}

template <class SampleType>
const std::string& Stream<SampleType>::channel() const { return core_->channel(); }

template <class SampleType>
SampleType Stream<SampleType>::latest(double timeout) const {
  return static_cast<const SampleType&>(*core_->latest(timeout));
}

template <class SampleType>
SampleType Stream<SampleType>::next(double timeout) const {
  return static_cast<const SampleType&>(*core_->next(timeout));
}

template <class SampleType>
void Stream<SampleType>::on_sample(std::function<void(const SampleType&)> callback) const {
  core_->on_sample([callback = std::move(callback)](const Sample& sample) { callback(static_cast<const SampleType&>(sample)); });
}

template class Stream<Scan>;
template class Stream<LidarScan>;
template class Stream<SonarReading>;
template class Stream<Odometry>;
template class Stream<Pose>;
template class Stream<Image>;
template class Stream<CameraInfo>;
template class Stream<Imu>;
template class Stream<Contact>;
template class Stream<Joints>;
template class Stream<MotionStatus>;

}  // namespace ruedo::client
