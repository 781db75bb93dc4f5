// One loop over the sinks for each kind of message.
#include "run/publisher.h"

#include <algorithm>
#include <utility>

namespace ruedo::run {

void Publisher::add(Sink& sink) {
  sinks_.push_back(&sink);
  ++changes_;
  choose_audience();
  if (announcement_) sink.announce(announcement_);
}

void Publisher::mute(bool muted) {
  muted_ = muted;
  choose_audience();
}

void Publisher::choose_audience() {
  audience_ = {};
  for (Sink* sink : sinks_) {
    const Sink::Hears hears = sink->hears();
    const bool follows = !muted_ || hears.repeated;
    if (follows) audience_.steps.push_back(sink);
    if (follows && hears.samples) audience_.samples.push_back(sink);
    if (hears.records) audience_.records.push_back(sink);
    if (hears.services) audience_.services.push_back(sink);
  }
}

void Publisher::announce(Announcement announcement) {
  announcement_ = std::make_shared<const Announcement>(std::move(announcement));
  sequences_.resize(announcement_->channels.list().size(), 0);
  ++changes_;
  for (Sink* sink : sinks_) sink->announce(announcement_);
}

engine::ReadChannels Publisher::read() const {
  engine::ReadChannels read;
  for (const engine::Channel& channel : announcement_->channels.list()) {
    read.push_back(std::any_of(sinks_.begin(), sinks_.end(), [&](const Sink* sink) {
      return sink->hears().samples && sink->wants(channel.bus_name);
    }));
  }
  return read;
}

uint64_t Publisher::audience() const {
  uint64_t changes = changes_;
  for (const Sink* sink : sinks_) changes += sink->audience();
  return changes;
}

void Publisher::begin_epoch(int32_t epoch) {
  epoch_ = epoch;
  base_us_ += time_us_;
  time_us_ = 0;
  step_ = -1;
  latest_ = nullptr;
  sequences_.assign(sequences_.size(), 0);
}

void Publisher::go_on_from(const Snapshot& state, const std::vector<int64_t>& sequences) {
  step_ = state.step;
  time_us_ = state.time;
  latest_ = &state;
  sequences_ = sequences;
}

void Publisher::publish(engine::Simulation& simulation, const engine::Batch& batch,
                        const Snapshot& state) {
  step_ = state.step;
  time_us_ = state.time;
  latest_ = &state;
  const Step step{step_, time_us_, epoch_};
  const SimTime stamp_us = base_us_ + time_us_;
  for (Sink* sink : audience_.steps) sink->begin_step(step);
  simulation.messages(batch, step_, [&](int64_t, int channel, const uint8_t* data, size_t size) {
    const engine::ChannelIndex index(channel);
    int64_t& sequence = sequences_[index];
    const Published message{
        Kind::sample, time_us_, stamp_us, announcement_->channels[index].bus_name,
        index,        sequence, data,     size};
    for (Sink* sink : audience_.samples) sink->message(message);
    ++sequence;
    ++messages_;
  });
  for (Sink* sink : audience_.steps) sink->end_step(step);
}

void Publisher::send(Kind kind, SimTime time_us, const std::string& channel,
                     engine::ChannelIndex index, int64_t sequence) {
  const Published message{kind,  time_us,  base_us_ + time_us, channel,
                          index, sequence, buffer_.data(),     buffer_.size()};
  for (Sink* sink : kind == Kind::record ? audience_.records : audience_.services)
    sink->message(message);
}

void Publisher::flush() {
  for (Sink* sink : sinks_) sink->flush();
}

}  // namespace ruedo::run
