// A run of the engine that is judged, and recorded as `ruedo verify` repeats it: of a campaign's
// case, a few kB of what acted.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/batch.h"
#include "engine/command_inbox.h"
#include "engine/judge/judge.h"
#include "engine/world_state.h"
#include "log/header.h"
#include "log/writer.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/errors.h"
#include "ruedo/log_header_t.hpp"
#include "ruedo/state_hash_t.hpp"
#include "world/model/world_model.h"

class WatchedRun {
 public:
  // log: a file; "": none.
  WatchedRun(std::shared_ptr<const ruedo::world::WorldModel> world,
             ruedo::judge::Expectations expected, const ruedo::log_header_t& header,
             const std::string& log)
      : step_us_(world->step_us),
        hash_clock_(ruedo::Rate{1, 1}, world->step_us),
        judge_(std::move(world), std::move(expected)) {
    if (log.empty()) return;
    log_ = std::make_unique<ruedo::log::Writer>(log);
    record(ruedo::log::kHeaderChannel, header);
  }

  ruedo::judge::Judge& judge() { return judge_; }

  // Each state in order, with the batch that it came in.
  void see(const ruedo::Snapshot& snapshot, const ruedo::engine::Batch& batch,
           const std::vector<ruedo::engine::Input>& inputs) {
    judge_.see(snapshot);
    record_hash();
    hash_.utime = snapshot.time;
    hash_.step = snapshot.step;
    if (!log_) return;
    hash_.state_hash = ruedo::engine::state_hash(snapshot);
    for (int i = 0; i < batch.applied_count; ++i) {
      const ruedo::engine::AppliedCommand& command = batch.applied[static_cast<size_t>(i)];
      if (command.step == snapshot.step - 1)
        record_applied(command, inputs[static_cast<size_t>(command.input)].channel);
    }
    hash_due_ = snapshot.step == next_hash_;
    if (hash_due_) next_hash_ = hash_clock_.step_of(++hashes_);
  }

  // A message of the state that was seen last.
  void record_message(const std::string& channel, std::span<const uint8_t> bytes) {
    if (log_) log_->write(hash_.utime, channel, bytes.data(), bytes.size());
  }

  // Throws EnvironmentError when the log could not be written.
  void end() {
    if (!log_) return;
    record_hash();
    hash_.last = true;
    record(ruedo::log::kStateHashChannel, hash_);
    log_->flush();
    if (!log_->error().empty()) throw ruedo::EnvironmentError(log_->path() + ": " + log_->error());
  }

 private:
  // The server's order: a state's messages, then its hash.
  void record_hash() {
    if (hash_due_) record(ruedo::log::kStateHashChannel, hash_);
    hash_due_ = false;
  }

  void record_applied(const ruedo::engine::AppliedCommand& command, const std::string& channel) {
    ruedo::applied_t applied;
    applied.step = command.step;
    applied.utime = command.step * step_us_;
    applied.epoch = 0;
    applied.sequence = 0;
    applied.channel = channel;
    applied.kind = 0;
    applied.size = static_cast<int32_t>(command.bytes.size());
    applied.data = command.bytes;
    record(ruedo::log::kAppliedChannel, applied);
  }

  template <class Message>
  void record(const std::string& channel, const Message& message) {
    buffer_.resize(static_cast<size_t>(message.getEncodedSize()));
    message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
    log_->write(message.utime, channel, buffer_.data(), buffer_.size());
  }

  int64_t step_us_;
  ruedo::SampleClock hash_clock_;
  int64_t next_hash_ = 0, hashes_ = 0;
  ruedo::judge::Judge judge_;
  ruedo::state_hash_t hash_{};  // of the state that was seen last
  bool hash_due_ = false;
  std::unique_ptr<ruedo::log::Writer> log_;
  std::vector<uint8_t> buffer_;
};
