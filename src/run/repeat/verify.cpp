// Two readers of one log: the replay drives the run from it, the comparison reads it again beside
// what the run records.
#include "run/repeat/verify.h"

#include <algorithm>
#include <optional>
#include <set>

#include "base/channel_names.h"
#include "base/progress.h"
#include "log/header.h"
#include "log/reader.h"
#include "ruedo/decode.h"

namespace ruedo::run {
namespace {

class Nowhere : public Bus {
 public:
  void publish(const std::string&, const uint8_t*, size_t) override {}
  void listen(const std::vector<std::string>&, Handler, const std::vector<std::string>&) override {}
};

using Values = std::vector<std::pair<std::string, std::string>>;

// Every value of a message; false for a type that is not known, or for a broken message.
bool values_of(const std::vector<uint8_t>& message, Values& values) {
  const Schema* schema = find_schema(fingerprint_of(message));
  return schema &&
         visit_message(*schema, message, [&](const FieldPath& path, const FieldValue& value) {
           values.emplace_back(path.str(), to_string(value));
           return true;
         });
}

// The first value that differs; of equal texts (a NaN's bits, say) or unknown types the first byte.
void name_field(const std::vector<uint8_t>& logged, const std::vector<uint8_t>& repeated,
                FirstDifference& difference) {
  Values then, now;
  if (values_of(logged, then) && values_of(repeated, now)) {
    for (size_t i = 0; i < std::max(then.size(), now.size()); ++i) {
      if (i < then.size() && i < now.size() && then[i] == now[i]) continue;
      const bool same_field = i < then.size() && i < now.size() && then[i].first == now[i].first;
      difference.field = i < then.size() ? then[i].first : now[i].first;
      difference.logged = i < then.size() ? then[i].second : "(absent)";
      difference.repeated = same_field        ? now[i].second
                            : i < then.size() ? "(absent)"
                                              : now[i].second;
      return;
    }
  }
  size_t at = 0;
  while (at < std::min(logged.size(), repeated.size()) && logged[at] == repeated[at]) ++at;
  const auto byte = [at](const std::vector<uint8_t>& bytes) {
    return at < bytes.size() ? std::to_string(int{bytes[at]}) : "(absent)";
  };
  difference.field = "byte " + std::to_string(at);
  difference.logged = byte(logged);
  difference.repeated = byte(repeated);
}

}  // namespace

class Verifier::Impl {
 public:
  Impl(const std::string& log, std::shared_ptr<const world::WorldModel> world, RunOptions options)
      : log_(log) {
    step_us_ = world->step_us;
    find_kept_channels(log);
    options.repeat = log;
    options.end_with_repeat = true;
    options.control = false;
    options.watcher = [this](SimTime stamp, const std::string& channel, const uint8_t* data,
                             size_t size) { see(stamp, channel, data, size); };
    server_ = std::make_unique<Run>(std::move(world), std::move(options), bus_);
  }

  Verification run() {
    progress_.emplace("repeating " + log_.path(), log_.size());
    server_->run();
    progress_.reset();
    if (!verdict_.difference && more_ && next_logged()) {
      differ(logged_.timestamp_us, logged_.channel, "a message", "the end of the run");
    }
    if (!verdict_.difference) verdict_.fault = log_.fault();
    if (!verdict_.difference && !ended_ && verdict_.fault.empty())
      verdict_.fault = "the end of the run is not in it";
    verdict_.time_us = last_stamp_;
    return verdict_;
  }

  const log_header_t& header() const { return server_->log_header(); }

  log_header_t log_header;
  std::vector<std::string> differences;

 private:
  // Inputs come from the log itself; the header describes the machine.
  bool is_compared(const std::string& channel) const {
    return channel != kAppliedChannel && channel != kHeaderChannel &&
           (kept_.empty() || kept_.contains(channel));
  }

  // Every run's log has ruedo/world. One without was thinned out, as campaigns keep them: the
  // channels that it has are compared, the hashes of the state among them.
  void find_kept_channels(const std::string& path) {
    log::Reader reader(path);
    log::Event event;
    bool hashed = false;
    while (reader.next(event, [](const std::string&) { return false; })) {
      if (event.channel == kWorldChannel) return kept_.clear();
      kept_.insert(event.channel);
      hashed |= event.channel == kStateHashChannel;
    }
    if (!hashed) kept_.clear();
  }

  bool next_logged() {
    while (more_) {
      more_ = log_.next(logged_);
      if (more_ && is_compared(logged_.channel)) return true;
    }
    return false;
  }

  void see(SimTime stamp, const std::string& channel, const uint8_t* data, size_t size) {
    if (stamp < last_stamp_ || verdict_.difference || !is_compared(channel)) return;
    if (progress_) progress_->to(log_.offset());
    if (channel == kStateHashChannel) note_epoch(stamp, data, size);
    if (!next_logged()) {
      // A log that was cut off ends before the run does; a complete one does not.
      if (ended_) differ(stamp, channel, "the end of the run", "a message");
      return;
    }
    last_stamp_ = stamp;
    if (logged_.channel != channel || logged_.timestamp_us != stamp) {
      const bool log_is_first = logged_.timestamp_us <= stamp;
      const auto named = [](const std::string& name, SimTime time) {
        return "a message on " + name + " at stamp " + std::to_string(time) + " us";
      };
      differ(log_is_first ? logged_.timestamp_us : stamp, log_is_first ? logged_.channel : channel,
             named(logged_.channel, logged_.timestamp_us), named(channel, stamp));
      return;
    }
    if (logged_.data.size() != size ||
        !std::equal(logged_.data.begin(), logged_.data.end(), data)) {
      differ(stamp, channel, "", "");
      name_field(logged_.data, {data, data + size}, *verdict_.difference);
      return;
    }
    ++verdict_.messages;
    verdict_.bytes += static_cast<int64_t>(size);
    if (channel == kStateHashChannel) {
      state_hash_t hash;
      ended_ = decode_checked(data, size, hash) == DecodeFault::none && hash.last;
    }
  }

  // Each epoch begins with a hash: where its sim time is 0 in stamps.
  void note_epoch(SimTime stamp, const uint8_t* data, size_t size) {
    state_hash_t hash;
    if (decode_checked(data, size, hash) != DecodeFault::none) return;
    epoch_ = hash.epoch;
    epoch_begin_us_ = stamp - hash.utime;
  }

  void differ(SimTime stamp, const std::string& channel, const std::string& logged,
              const std::string& repeated) {
    FirstDifference& difference = verdict_.difference.emplace();
    difference.channel = channel;
    difference.epoch = epoch_;
    difference.time_us = stamp - epoch_begin_us_;
    difference.step = difference.time_us / step_us_;
    difference.logged = logged;
    difference.repeated = repeated;
    server_->stop();
  }

  log::Reader log_;
  log::Event logged_;
  std::optional<Progress> progress_;
  bool more_ = true, ended_ = false;
  std::set<std::string> kept_;  // channels of a log that was thinned out; empty: all
  int64_t step_us_ = 1;
  SimTime last_stamp_ = 0, epoch_begin_us_ = 0;
  int32_t epoch_ = 0;
  Verification verdict_;
  Nowhere bus_;
  std::unique_ptr<Run> server_;
};

Verifier::Verifier(const std::string& log, std::shared_ptr<const world::WorldModel> world,
                   RunOptions options)
    : impl_(std::make_unique<Impl>(log, std::move(world), std::move(options))), log_(log) {
  impl_->log_header = read_header(log);
  impl_->differences = log::machine_differences(impl_->log_header, impl_->header());
}

Verifier::~Verifier() = default;

const std::vector<std::string>& Verifier::machine_differences() const { return impl_->differences; }
void Verifier::check_same_run() const {
  log::check_same_run(impl_->log_header, impl_->header(), log_);
}
Verification Verifier::run() { return impl_->run(); }

}  // namespace ruedo::run
