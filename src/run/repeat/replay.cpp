// Reads a log just far enough ahead of the run that repeats it.
#include "run/repeat/replay.h"

#include <algorithm>
#include <limits>

#include "log/header.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/reset_request_t.hpp"
#include "run/journal.h"
#include "run/requests/request_table.h"

namespace ruedo::run {
namespace {

log_header_t first_event(log::Reader& reader, log::Event& event) {
  log_header_t header;
  if (reader.size() == 0) throw InputError({reader.path()}, "is empty: nothing was recorded");
  const bool found = reader.next(event);
  if (!found && !reader.fault().empty()) throw InputError({reader.path()}, reader.fault());
  if (!found || event.channel != kHeaderChannel) {
    throw InputError({reader.path()},
                     "does not begin with ruedo/header: it was not recorded by ruedo run --record");
  }
  if (decode_checked(event.data.data(), event.data.size(), header) != DecodeFault::none ||
      header.step_us < 1) {
    throw InputError({reader.path()}, "its header is damaged, or another version of Ruedo's");
  }
  log::find_files_again(header, reader.path());
  return header;
}

bool is_replayed(const std::string& channel) {
  return channel == kAppliedChannel || channel == kStateHashChannel;
}

// Sim time is 0 again.
bool begins_anew(const applied_t& applied) {
  reset_request_t reset;
  return applied.kind == request_t::RESET &&
         decode_checked(applied.data.data(), applied.data.size(), reset) == DecodeFault::none &&
         reset.what != reset_request_t::POSES;
}

// Joining and leaving does not affect the world.
bool acts(int32_t kind) {
  const RequestKind* known = find_request_kind(kind);
  return known && known->effect == RequestKind::acts;
}

}  // namespace

Length length_of(const std::string& path) {
  log::Reader reader(path);
  log::Event event;
  first_event(reader, event);
  Length length;
  applied_t applied;
  state_hash_t hash;
  int64_t last = 0;  // step of the sim time that was begun last
  bool ended = false;
  const auto add_last = [&] {
    const int64_t room = std::numeric_limits<int64_t>::max() - length.steps;
    length.steps += std::clamp<int64_t>(last, 0, room);
    last = 0;
  };
  while (reader.next(event, is_replayed)) {
    const bool acted = event.channel == kAppliedChannel;
    const DecodeFault fault = acted ? decode_checked(event.data.data(), event.data.size(), applied)
                                    : decode_checked(event.data.data(), event.data.size(), hash);
    if (fault != DecodeFault::none) continue;  // Replay refuses it when it comes to it
    last = std::max(last, acted ? applied.step : hash.step);
    ended = !acted && hash.last;
    if (acted && begins_anew(applied)) add_last();
  }
  add_last();
  if (!ended) {
    length.fault =
        reader.fault().empty() ? "cut off: the end of the run is not in it" : reader.fault();
  }
  return length;
}

log_header_t read_header(const std::string& path) {
  log::Reader reader(path);
  log::Event event;
  return first_event(reader, event);
}

Replay::Replay(const std::string& path) : reader_(path), header_(first_event(reader_, event_)) {}

void Replay::damaged(const std::string& what) const {
  throw InputError({reader_.path()}, "cannot be repeated: " + what);
}

const applied_t* Replay::advance(int64_t step, const Target& target) {
  const auto go_on_to = [&](int64_t last) {
    target.gate.set_limit(last);
    return nullptr;
  };
  for (;;) {
    if (waits_) {
      if (const engine::InputIndex input = target.input_of(applied_); input.valid()) {
        switch (target.inbox.schedule(applied_.step, input,
                                      reinterpret_cast<const uint8_t*>(applied_.data.data()),
                                      applied_.data.size())) {
          case engine::CommandInbox::Scheduled::kept: waits_ = false; continue;
          case engine::CommandInbox::Scheduled::full: return go_on_to(applied_.step);
          case engine::CommandInbox::Scheduled::late:
          case engine::CommandInbox::Scheduled::faulty:
            damaged("the recorded command on " + applied_.channel + " at step " +
                    std::to_string(applied_.step) + " is not a valid message");
        }
      }
      if (!acts(applied_.kind)) {
        waits_ = false;
        continue;
      }
      if (applied_.step > step) return go_on_to(applied_.step);
      if (applied_.step < step)
        damaged("its request for step " + std::to_string(applied_.step) + " comes after step " +
                std::to_string(step));
      return &applied_;
    }
    if (ended_) return go_on_to(end_step_);
    if (known_ > step + kAhead) return go_on_to(known_);
    read(target);
  }
}

void Replay::executed() {
  waits_ = false;
  known_ = -1;  // sim time may be reset
}

void Replay::read(const Target& target) {
  if (!reader_.next(event_, is_replayed)) {
    ended_ = true;
    end_step_ = end_.last ? end_.step : known_;
    return;
  }
  end_.last = false;
  // The messages of a state, and what acted on it, come after everything that acted on those before
  // it.
  known_ = std::max(known_, (event_.timestamp_us - target.begin_us) / header_.step_us);
  if (event_.channel == kAppliedChannel) {
    if (decode_checked(event_.data.data(), event_.data.size(), applied_) != DecodeFault::none)
      damaged("a ruedo/applied in it is damaged");
    waits_ = true;
  } else if (event_.channel == kStateHashChannel) {
    if (decode_checked(event_.data.data(), event_.data.size(), end_) != DecodeFault::none)
      damaged("a ruedo/state_hash in it is damaged");
  }
}

}  // namespace ruedo::run
