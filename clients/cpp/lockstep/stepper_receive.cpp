// Putting ticks and messages of lockstep together, as they come: in any order, twice, or not at
// all.
#include <algorithm>
#include <array>
#include <utility>

#include "core.h"
#include "lockstep/stepper.h"
#include "ruedo/reply_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/resend_reply_t.hpp"
#include "ruedo/tick_t.hpp"
#include "samples/wire_reader.h"
#include "samples/world_info.h"

namespace ruedo::client {
namespace {

constexpr size_t kMostEarly = 512;             // messages of one channel that wait for their ticks
constexpr size_t kMostEarlyBytes = 256 << 20;  // of all: no server continues with so much unheard
constexpr int32_t kMostChannels = 1 << 16;     // more cannot be subscribed
constexpr int kMostParts = 1024;
constexpr size_t kMostListed = 1 << 20;  // messages: 160 steps of a fleet
constexpr int64_t kMostAhead = 1024;     // steps beyond what is here: no server is that far

}  // namespace

uint32_t crc32(const uint8_t* bytes, size_t size) {
  static const auto table = [] {
    std::array<std::array<uint32_t, 256>, 4> made{};
    for (uint32_t i = 0; i < 256; ++i) {
      uint32_t value = i;
      for (int bit = 0; bit < 8; ++bit) value = value & 1 ? value >> 1 ^ 0xEDB88320u : value >> 1;
      made[0][i] = value;
    }
    for (size_t k = 1; k < 4; ++k)
      for (size_t i = 0; i < 256; ++i)
        made[k][i] = made[0][made[k - 1][i] & 255] ^ made[k - 1][i] >> 8;
    return made;
  }();
  uint32_t crc = ~0u;
  for (; size >= 4; bytes += 4, size -= 4) {
    const uint32_t word = crc ^ (bytes[0] | uint32_t{bytes[1]} << 8 | uint32_t{bytes[2]} << 16 |
                                 uint32_t{bytes[3]} << 24);
    crc = table[3][word & 255] ^ table[2][word >> 8 & 255] ^ table[1][word >> 16 & 255] ^
          table[0][word >> 24];
  }
  for (; size > 0; ++bytes, --size) crc = table[0][(crc ^ *bytes) & 255] ^ crc >> 8;
  return ~crc;
}

void Stepper::on_info(const std::shared_ptr<const WorldInfo>& info) {
  const std::lock_guard lock(mutex_);
  if (part_) names_.change(*info);
}

void Stepper::on_message(int32_t channel, const uint8_t* bytes, size_t size) {
  if (size < 16) return;
  WireReader in(bytes, size);
  in.int64();  // fingerprint
  const int64_t utime = in.int64();
  const uint32_t crc = crc32(bytes, size);
  std::vector<uint8_t> copy(bytes, bytes + size);
  std::lock_guard lock(mutex_);
  if (!part_) return;
  for (auto& [number, step] : steps_) {  // a tick may come before its messages
    if (number > have_ && step.missing > 0 && fill(step, channel, size, crc, copy))
      return progress();
  }
  std::deque<Early>& early = early_[static_cast<size_t>(channel)];
  if (early.size() == kMostEarly) forget_first(early);
  early.push_back({size, crc, utime, std::move(copy)});
  early_bytes_ += size;
  if (early_bytes_ <= kMostEarlyBytes) return;
  for (std::deque<Early>& all : early_) all.clear();  // missing messages are requested
  early_bytes_ = 0;
}

void Stepper::forget_first(std::deque<Early>& early) {
  early_bytes_ -= early.front().size;
  early.pop_front();
}

bool Stepper::fill(Step& step, int32_t channel, size_t size, uint32_t crc,
                   std::vector<uint8_t>& bytes) {
  for (std::vector<Entry>& part : step.parts) {
    for (Entry& entry : part) {
      if (entry.channel != channel || entry.size != size || entry.crc != crc || entry.here())
        continue;
      entry.bytes = std::move(bytes);
      --step.missing;
      return true;
    }
  }
  return false;
}

void Stepper::on_tick(const uint8_t* bytes, size_t size) {
  std::lock_guard lock(mutex_);
  try {
    if (part_) take_tick(bytes, size);
  } catch (const WireError&) {
    return;  // broken: it is requested again
  }
}

void Stepper::take_tick(const uint8_t* bytes, size_t size) {
  WireReader in(bytes, size);
  if (in.int64() != tick_t::getHash()) return;
  const int64_t utime = in.int64(), run_id = in.int64();
  const int32_t epoch = in.int32();
  const int64_t number = in.int64(), state_hash = in.int64();
  const int part = in.int16(), nparts = in.int16();
  if (run_id != run_id_ || part < 0 || part >= nparts || nparts > kMostParts) return;
  if (epoch != epoch_) {
    if (epoch > epoch_ && !fault_)
      fault_ = std::make_exception_ptr(
          Error("the world was reset by another client: the next step begins anew"));
    return;
  }
  newest_ = std::max(newest_, number);
  for (size_t n = in.count(13); n > 0;
       --n) {  // applied: only this says that the grant was executed
    const std::string client = in.string();
    if (in.int64() >= grant_.sequence && number > grant_.from && client == core_.session().name())
      grant_.taken = true;
  }
  if (number <= have_ || number > have_ + kMostAhead) return;
  Step& step = steps_[number];
  if (step.nparts == 0) {
    step.nparts = static_cast<size_t>(nparts);
    step.parts.resize(step.nparts);
    step.part_here.resize(step.nparts);
    step.utime = utime;
    step.state_hash = state_hash;
  }
  if (step.nparts != static_cast<size_t>(nparts) || step.part_here[static_cast<size_t>(part)])
    return;
  std::vector<Entry> entries;
  size_t missing = 0;
  for (size_t n = in.count(20); n > 0; --n) {
    entries.push_back(read_entry(in));
    missing += entries.back().here() ? 0 : 1;
  }
  step.parts[static_cast<size_t>(part)] = std::move(entries);
  step.missing += missing;
  step.part_here[static_cast<size_t>(part)] = true;
  ++step.parts_here;
  listed_ += step.parts[static_cast<size_t>(part)].size();
  if (listed_ > kMostListed) forget_steps();
  progress();
}

// A message of a step; it may have come before the tick that names it.
Stepper::Entry Stepper::read_entry(WireReader& in) {
  Entry entry;
  entry.channel = in.int32();
  entry.sequence = in.int64();
  const int32_t size = in.int32();
  entry.crc = static_cast<uint32_t>(in.int32());
  if (entry.channel < 0 || entry.channel >= kMostChannels || size < 0)
    throw WireError("no message");
  entry.size = static_cast<size_t>(size);
  const auto channel = static_cast<size_t>(entry.channel);
  if (channel >= early_.size()) early_.resize(channel + 1);  // of a model that came
  std::deque<Early>& early = early_[channel];
  const auto found = std::find_if(early.begin(), early.end(), [&](const Early& one) {
    return one.size == entry.size && one.crc == entry.crc;
  });
  if (found != early.end()) {
    entry.bytes = std::move(found->bytes);
    early_bytes_ -= found->size;
    early.erase(found);
  }
  return entry;
}

// With the mutex held, after something came.
void Stepper::progress() {
  for (auto step = steps_.find(have_ + 1);
       step != steps_.end() && step->first == have_ + 1 && step->second.complete(); ++step) {
    ++have_;
    for (const std::vector<Entry>& part : step->second.parts) {
      listed_ -= part.size();
      for (const Entry& entry : part) {  // what is left from earlier times came twice
        std::deque<Early>& early = early_[static_cast<size_t>(entry.channel)];
        while (!early.empty() && early.front().utime <= step->second.utime) forget_first(early);
      }
    }
  }
}

void Stepper::on_reply(const Reply& reply) {
  std::lock_guard lock(mutex_);
  if (!part_) return;
  if (reply.code != reply_t::OK) {
    if (reply.kind == request_t::GRANT ? (grant_.taken || reply.sequence != grant_.sequence)
                                       : reply.sequence != resend_sequence_)
      return;
    if (!fault_) fault_ = fault_of(reply);
    return;
  }
  try {
    if (reply.kind == request_t::RESEND) return take_pieces(reply.body);
    if (reply.sequence != grant_.sequence || grant_.taken) return;
    grant_.taken = ask_now_ = true;  // it was repeated: its ticks may be lost
  } catch (const WireError&) {
    return;  // damaged: it is requested again
  }
}

std::exception_ptr Stepper::fault_of(const Reply& reply) const {
  const std::string text = (reply.kind == request_t::GRANT ? "GRANT: " : "RESEND: ") + reply.text;
  if (reply.code == reply_t::UNKNOWN_SESSION)
    return std::make_exception_ptr(LeaseLost(text, ReplyCode::unknown_session));
  if (reply.code == reply_t::ENDED) return std::make_exception_ptr(RunEnded(text));
  if (reply.code == reply_t::WRONG_RUN || reply.code == reply_t::REFUSED)
    return std::make_exception_ptr(NoServer(text));
  return std::make_exception_ptr(RequestError(text, static_cast<ReplyCode>(reply.code)));
}

void Stepper::take_pieces(const std::vector<uint8_t>& body) {
  WireReader in(body.data(), body.size());
  if (in.int64() != resend_reply_t::getHash()) throw WireError("another version of the type");
  newest_ = std::max(newest_, in.int64());
  waits_for_ = in.text();
  std::vector<std::vector<uint8_t>> ticks;
  const size_t count = in.count(32);
  const bool any = count > 0;
  for (size_t n = count; n > 0; --n) {
    const int64_t number = in.int64();
    const int32_t channel = in.int32();
    const int64_t sequence = in.int64();
    in.int32();  // total
    const auto offset = static_cast<size_t>(in.int32());
    std::vector<uint8_t> piece = in.bytes(in.count(1));
    if (channel == info_->tick_channel) {
      ticks.push_back(std::move(piece));
      continue;
    }
    const auto step = steps_.find(number);
    if (step == steps_.end()) continue;
    for (std::vector<Entry>& part : step->second.parts) {
      for (Entry& entry : part) {
        if (entry.channel != channel || entry.sequence != sequence || entry.here() ||
            entry.bytes.size() != offset)
          continue;
        if (piece.size() > entry.size - offset) continue;
        entry.bytes.insert(entry.bytes.end(), piece.begin(), piece.end());
        if (!entry.here()) continue;
        if (crc32(entry.bytes.data(), entry.size) == entry.crc) {
          --step->second.missing;
        } else {
          entry.bytes.clear();  // from the start again
        }
      }
    }
  }
  for (const std::vector<uint8_t>& tick : ticks) take_tick(tick.data(), tick.size());
  progress();
  ask_now_ = any;  // more may be missing than goes into one reply
}

}  // namespace ruedo::client
