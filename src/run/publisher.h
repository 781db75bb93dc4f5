// Hands each state's messages, what acted on the run, and what the run itself says to all sinks, in
// one order.
//
// It numbers the messages of each channel and stamps them for logs. Not thread safe: the thread of
// Run::run() publishes.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/simulation.h"
#include "ruedo/snapshot.h"
#include "run/sink.h"

namespace ruedo::run {

class Publisher {
 public:
  // The sink must outlive it. Sinks hear in the order in which they were added.
  void add(Sink& sink);

  // While muted, samples go only to sinks that hear what is repeated.
  void mute(bool muted);

  // The channels and info from now on.
  void announce(Announcement announcement);
  // Sim time was reset to 0, and no state was published yet. Stamps go on.
  void begin_epoch(int32_t epoch);
  // Then: it continues from a state of another epoch, whose messages had these sequences().
  void go_on_from(const Snapshot& state, const std::vector<int64_t>& sequences);
  const std::vector<int64_t>& sequences() const { return sequences_; }

  // A state of the batch, and its messages.
  void publish(engine::Simulation& simulation, const engine::Batch& batch, const Snapshot& state);

  // A message of the run itself, at the time of the last state. sequence: as in Published.
  template <class Message>
  void service(engine::ChannelIndex channel, const Message& message, int64_t sequence = 0) {
    encode(message);
    send(Kind::service, time_us_, announcement_->channels[channel].bus_name, channel, sequence);
    ++messages_;
  }
  // At the message's own utime.
  template <class Message>
  void record(const std::string& channel, const Message& message) {
    encode(message);
    send(Kind::record, message.utime, channel, {}, 0);
  }

  void flush();

  // By channel: whether any sink reads its samples, be they muted now or not.
  engine::ReadChannels read() const;
  // Grows whenever read() may be another.
  uint64_t audience() const;

  bool has_recorders() const { return !audience_.records.empty(); }
  const Announcement& announcement() const { return *announcement_; }

  // Of the last state that was published; in a new epoch -1, 0 and null.
  int64_t step() const { return step_; }
  SimTime time_us() const { return time_us_; }
  const Snapshot* latest() const { return latest_; }
  // The same state as a request changed it. Nothing before the first state.
  void change_latest(const Snapshot& state) {
    if (latest_) latest_ = &state;
  }

  int32_t epoch() const { return epoch_; }
  uint64_t messages() const { return messages_; }  // samples and services
  SimTime base_us() const { return base_us_; }     // the stamp of sim time 0 in this epoch

 private:
  // Who hears what now.
  struct Audience {
    std::vector<Sink*> samples, records, services, steps;
  };

  void choose_audience();
  void send(Kind kind, SimTime time_us, const std::string& channel, engine::ChannelIndex index,
            int64_t sequence);
  template <class Message>
  void encode(const Message& message) {
    buffer_.resize(static_cast<size_t>(message.getEncodedSize()));
    message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
  }

  std::vector<Sink*> sinks_;
  Audience audience_;
  bool muted_ = false;
  uint64_t changes_ = 0;  // of the sinks and channels
  std::shared_ptr<const Announcement> announcement_;
  std::vector<int64_t> sequences_;  // messages on each channel in this epoch
  int32_t epoch_ = 0;
  int64_t step_ = -1;
  SimTime time_us_ = 0, base_us_ = 0;
  const Snapshot* latest_ = nullptr;
  uint64_t messages_ = 0;
  std::vector<uint8_t> buffer_;
};

}  // namespace ruedo::run
