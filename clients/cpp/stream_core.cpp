// Streams: subscription, waiting, and the typed faces of both.
#include "stream_core.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "core.h"

namespace ruedo::client {
namespace {

constexpr double kMostUneven = 0.25;  // periods: with longer steps, gaps of samples show no
                                      // losses
constexpr size_t kHead = 16;  // bytes of a message: fingerprint, and in all of the server's types
                              // the time

double period_us(double rate, int64_t step_us) {
  const bool even = rate > 0.0 && static_cast<double>(step_us) * 1e-6 * rate <= kMostUneven;
  return even ? 1e6 / rate : 0.0;
}

}  // namespace

// A message that came.
class StreamCore::Arrival {
 public:
  Arrival(const uint8_t* bytes, size_t size, std::optional<int64_t> utime)
      : utime_(utime), bytes_(bytes, bytes + size) {}

  // Decoded once. Throws TypeMismatch.
  std::shared_ptr<const Sample> sample(const StreamCore& stream) {
    const std::lock_guard lock(mutex_);
    if (!sample_) sample_ = stream.decoded(bytes_);
    return sample_;
  }
  size_t size() const { return bytes_.size(); }
  std::optional<int64_t> utime() const { return utime_; }  // us; nothing: its type does not say

  int64_t number = 0;  // of the samples of the stream, with those that were lost

 private:
  const std::optional<int64_t> utime_;
  const std::vector<uint8_t> bytes_;
  std::mutex mutex_;
  std::shared_ptr<const Sample> sample_;
};

StreamCore::StreamCore(std::weak_ptr<Core> core, const ChannelInfo& channel,
                       const SampleDecoder* decoder, int64_t step_us,
                       const std::shared_ptr<CallbackFaults>& faults)
    : core_(std::move(core)),
      channel_(channel.name),
      robot_(channel.robot),
      type_(channel.type),
      fingerprint_(channel.fingerprint),
      rate_(channel.rate),
      period_us_(period_us(channel.rate, step_us)),
      decoder_(decoder),
      callbacks_(std::make_shared<Callbacks>(faults)) {}

std::shared_ptr<Core> StreamCore::connection() const {
  auto core = core_.lock();
  if (!core) throw NoServer(kClosed);
  core->check_open();
  return core;
}

Subscription StreamCore::on_sample(std::function<void(const Sample&)> callback) {
  const auto core = connection();
  subscribe(*core);
  core->callbacks().start();
  Subscription subscription(callbacks_->add(channel_, std::move(callback)));
  core->progress().listen();
  return subscription;
}

Subscription StreamCore::on_arrival(std::function<void(const Sample&)> callback) {
  subscribe(*connection());
  return Subscription(arrivals_->add(channel_, std::move(callback)));
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
        if (const auto stream = self.lock()) stream->on_message(bytes, size);
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
  newest_ = nullptr;
  fault_ = nullptr;
  last_utime_.reset();
  kept_.clear();
  kept_bytes_ = 0;
}

void StreamCore::end() {
  Subscription source;
  {
    const std::lock_guard lock(opening_);
    source = std::move(source_);
  }
}

void StreamCore::on_message(const uint8_t* bytes, size_t size) {
  const auto core = core_.lock();
  if (!core || core->closed() || core->in_doubt()) return;
  const int64_t fingerprint = size < kHead ? 0 : read_big_endian<int64_t>(bytes);
  if (size >= kHead && !is_raw() && fingerprint != decoder_->fingerprint)
    return fail(std::make_exception_ptr(mismatch(fingerprint)));
  std::optional<int64_t> utime;
  if (const SampleDecoder* own = find_decoder(type_); own && fingerprint == own->fingerprint)
    utime = read_big_endian<int64_t>(bytes + 8);
  const auto arrival = std::make_shared<Arrival>(bytes, size, utime);
  std::shared_ptr<const Sample> sample;
  try {
    if (!arrivals_->empty()) sample = arrival->sample(*this);
  } catch (const TypeMismatch&) {
    return fail(std::current_exception());
  }
  if (utime) core->clock().note(*utime);
  {
    const std::lock_guard lock(mutex_);
    newest_ = arrival;
    fault_ = nullptr;
    arrival->number = count_ += 1 + lost_before(utime);
    keep(arrival);
    if (!waiting_.empty()) core->progress().use(core->utime(), waiting_);
  }
  news_.notify_all();
  if (sample) arrivals_->call(*sample);
  if (callbacks_->empty()) return;
  core->callbacks().put_sample(
      [self = weak_from_this(), arrival] {
        if (const auto stream = self.lock()) stream->call_back(*arrival);
      },
      channel_, missed_, size);
}

void StreamCore::call_back(Arrival& arrival) {
  std::shared_ptr<const Sample> sample;
  try {
    sample = arrival.sample(*this);
  } catch (const TypeMismatch&) {
    return fail(std::current_exception());
  }
  callbacks_->call(*sample);
}

void StreamCore::fail(std::exception_ptr fault) {
  const std::lock_guard lock(mutex_);
  fault_ = std::move(fault);
  news_.notify_all();
}

std::shared_ptr<const Sample> StreamCore::decoded(const std::vector<uint8_t>& bytes) const {
  try {
    WireReader in(bytes.data(), bytes.size());
    in.int64();  // fingerprint
    return decoder_->decode(in);
  } catch (const WireError& error) {
    throw TypeMismatch(channel_ + ": a message of " + std::to_string(bytes.size()) +
                       " bytes is not a valid " + type_ + ": " + error.what());
  }
}

void StreamCore::keep(const std::shared_ptr<Arrival>& arrival) {
  constexpr size_t kMost = 256, kMostBytes = 4u << 20;
  if (!kept_.empty() && arrival->utime() < kept_.back()->utime()) {  // sim time was reset
    kept_.clear();
    kept_bytes_ = 0;
  }
  kept_.push_back(arrival);
  kept_bytes_ += arrival->size();
  while (kept_.size() > least_kept_ && (kept_.size() > kMost || kept_bytes_ > kMostBytes)) {
    kept_bytes_ -= kept_.front()->size();
    kept_.pop_front();
  }
}

int64_t StreamCore::kept_from() {
  const std::lock_guard lock(mutex_);
  return kept_.empty() ? 0 : kept_.front()->utime().value_or(0);
}

std::optional<StreamCore::Neighbours> StreamCore::around(int64_t utime, Duration timeout) {
  const auto core = connection();
  if (!find_decoder(type_))
    throw NotSupported(channel_ + " carries " + type_ + ", whose messages have no time");
  subscribe(*core);
  core->note_use();
  core->bus().catch_up();
  std::shared_ptr<Arrival> before, after;
  {
    std::unique_lock lock(mutex_);
    const auto reached = [utime](const auto& arrival) { return arrival->utime() >= utime; };
    await(*core, lock, timeout, [&] { return !kept_.empty() && reached(kept_.back()); });
    const auto found = std::find_if(kept_.begin(), kept_.end(), reached);
    after = *found;
    if (after->utime() != utime && found == kept_.begin()) return std::nullopt;
    before = after->utime() == utime ? after : *std::prev(found);
  }
  core->note_use();
  return Neighbours{before->sample(*this), after->sample(*this)};
}

// How many samples are missing since the last one. With the mutex held, as the next two.
int64_t StreamCore::lost_before(std::optional<int64_t> utime) {
  const auto last = std::exchange(last_utime_, utime);
  if (!last || !utime || *utime <= *last || period_us_ == 0.0) return 0;
  const double gap = static_cast<double>(*utime) - static_cast<double>(*last);
  constexpr double kMost = 1e9;  // a time may be false
  return std::max<int64_t>(0, std::llround(std::min(gap / period_us_, kMost)) - 1);
}

void StreamCore::set_queue_depth(int64_t depth) {
  constexpr int64_t kMost = 1000;
  if (depth < 1 || depth > kMost)
    throw std::invalid_argument("queue_depth is " + std::to_string(depth) + "; allowed are 1 to " +
                                std::to_string(kMost));
  depth_ = depth;
  const std::lock_guard lock(mutex_);
  least_kept_ = std::max(least_kept_, static_cast<size_t>(depth));
}

std::shared_ptr<StreamCore::Arrival> StreamCore::unseen(int64_t seen, int64_t depth,
                                                        int64_t not_before) const {
  std::shared_ptr<Arrival> found;
  for (auto arrival = kept_.rbegin(); arrival != kept_.rend() && depth > 0; ++arrival, --depth) {
    if ((*arrival)->number <= seen || (*arrival)->utime().value_or(not_before) < not_before) break;
    found = *arrival;
  }
  return found;
}

void StreamCore::await(Core& core, std::unique_lock<std::mutex>& lock, Duration timeout,
                       const std::function<bool()>& ready) {
  const Clock::time_point deadline = deadline_after(timeout);
  const auto me = std::this_thread::get_id();
  waiting_.push_back(me);
  struct Leave {
    std::vector<std::thread::id>& waiting;
    const std::thread::id me;
    ~Leave() { waiting.erase(std::find(waiting.begin(), waiting.end(), me)); }
  };
  const Leave leave{waiting_, me};
  while (!ready()) {
    if (fault_) std::rethrow_exception(std::exchange(fault_, nullptr));
    core.check_may_wait();
    if (Clock::now() >= deadline) {
      throw Timeout("no sample on " + channel_ + " within " + text_of(timeout) + " s (" +
                    core.what_is_known(rate_) + ")");
    }
    core.progress().wait();
    news_.wait_until(lock, std::min(deadline, Clock::now() + std::chrono::milliseconds(500)));
    core.check_open();
    if (!ready()) core.check_server();  // else the run may have ended since
  }
}

std::shared_ptr<const Sample> StreamCore::read(std::atomic<int64_t>& seen,
                                               std::atomic<int64_t>& skipped, int64_t depth,
                                               Duration timeout) {
  const auto core = connection();
  subscribe(*core);
  core->note_use();
  core->bus().catch_up();
  const int64_t not_before = core->not_before();
  std::shared_ptr<Arrival> arrival;
  {
    std::unique_lock lock(mutex_);
    await(*core, lock, timeout, [&] {
      arrival = depth == 0 ? newest_ : unseen(seen, depth, not_before);
      return arrival != nullptr;
    });
    if (seen > 0) skipped += std::max<int64_t>(arrival->number - seen - 1, 0);
    last_read_ = seen = arrival->number;
    last_skipped_ = skipped.load();
  }
  core->note_use();
  try {
    return arrival->sample(*this);
  } catch (const TypeMismatch&) {
    const std::lock_guard lock(mutex_);
    if (newest_ == arrival) newest_ = nullptr;
    throw;
  }
}

template <class SampleType>
Stream<SampleType>::Stream(std::shared_ptr<StreamCore> core)
    : core_(std::move(core)),
      seen_(core_->last_read()),
      skipped_(core_->last_skipped()),
      depth_(core_->queue_depth()) {}

template <class SampleType>
const std::string& Stream<SampleType>::channel() const {
  return core_->channel();
}

template <class SampleType>
SampleType Stream<SampleType>::latest(Duration timeout) const {
  return static_cast<const SampleType&>(*core_->read(seen_, skipped_, 0, timeout));
}

template <class SampleType>
SampleType Stream<SampleType>::next(Duration timeout) const {
  return static_cast<const SampleType&>(*core_->read(seen_, skipped_, depth_, timeout));
}

template <class SampleType>
std::optional<SampleType> Stream<SampleType>::find(int64_t utime, Duration timeout) const {
  const auto found = core_->around(utime, timeout);
  if (!found) return std::nullopt;
  const auto& before = static_cast<const SampleType&>(*found->before);
  const auto& after = static_cast<const SampleType&>(*found->after);
  if (before.utime == utime) return before;
  if constexpr (std::is_same_v<SampleType, Pose> || std::is_same_v<SampleType, Odometry>)
    return before.interpolated(after, utime);
  return utime - before.utime < after.utime - utime ? before : after;
}

template <class SampleType>
SampleType Stream<SampleType>::at(int64_t utime, Duration timeout) const {
  if (auto found = find(utime, timeout)) return *std::move(found);
  throw Timeout(channel() + " has no sample of " + text_of(static_cast<double>(utime) * 1e-6) +
                " s: those that it has kept, from its first use on, begin at " +
                text_of(static_cast<double>(core_->kept_from()) * 1e-6) +
                " s. Use it before, or sim.synchronised()");
}

template <class SampleType>
void Stream<SampleType>::subscribe() const {
  core_->listen();
}

template <class SampleType>
int64_t Stream<SampleType>::dropped() const {
  return skipped_ + core_->missed();
}

template <class SampleType>
void Stream<SampleType>::set_queue_depth(int64_t depth) {
  core_->set_queue_depth(depth);
  depth_ = depth;
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
