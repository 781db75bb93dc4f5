// The data of a channel's first message is read for its type, and those of the header and of
// requests for what they say.
#include "log/index.h"

#include <algorithm>
#include <unordered_map>

#include "log/header.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/request_t.hpp"

namespace ruedo::log {
bool changes_world(int32_t kind) {
  return kind == request_t::SPAWN || kind == request_t::REMOVE || kind == request_t::RESET;
}

size_t Index::Channel::count_until(SimTime time_us) const {
  const auto after =
      std::upper_bound(entries.begin(), entries.end(), time_us,
                       [](SimTime time, const Entry& entry) { return time < entry.time_us; });
  return static_cast<size_t>(after - entries.begin());
}

Index::Index(const std::string& path) {
  Reader reader(path, "indexing");
  Event event;
  std::unordered_map<std::string, size_t> known;  // looked up only
  const auto wanted = [&](const std::string& channel) {
    return channel == kAppliedChannel || !known.contains(channel);
  };
  size_t messages = 0;
  bool crowded = false;
  for (int64_t offset = 0; reader.next(event, wanted); offset = reader.offset()) {
    if (messages == kMostMessages) {
      fault_ = "has more than " + std::to_string(kMostMessages) +
               " messages: those after them are not shown";
      break;
    }
    if (channels_.size() == kMostChannels && !known.contains(event.channel)) {
      crowded = true;
      continue;
    }
    const auto [at, fresh] = known.try_emplace(event.channel, channels_.size());
    if (fresh) channels_.push_back({event.channel, fingerprint_of(event.data), {}});
    if (messages++ == 0) begin_us_ = end_us_ = event.timestamp_us;
    add(event, offset, reader.offset(), at->second);
  }
  if (!reader.fault().empty()) fault_ = reader.fault();
  if (crowded && fault_.empty())
    fault_ =
        "has more than " + std::to_string(kMostChannels) + " channels: the others are not shown";
  if (messages == 0)
    throw InputError({path}, "holds no message" + (fault_.empty() ? "" : ": " + fault_));
  if (header_) find_files_again(*header_, path);
}

void Index::add(const Event& event, int64_t offset, int64_t end, size_t channel) {
  const bool first = channels_[channel].entries.empty();
  if (first && event.channel == kHeaderChannel) {
    log_header_t header;
    if (decode_checked(event.data.data(), event.data.size(), header) == DecodeFault::none)
      header_ = std::move(header);
  }
  end_us_ = std::max(end_us_, event.timestamp_us);
  channels_[channel].entries.push_back({end_us_, offset, static_cast<uint32_t>(end - offset)});
  if (event.channel != kAppliedChannel) return;
  applied_t applied;
  if (decode_checked(event.data.data(), event.data.size(), applied) != DecodeFault::none) return;
  // SET_POSE does where what it puts elsewhere stands fast. Counted by itself: a program that puts
  // something elsewhere all the time hides no other change.
  const bool puts = applied.kind == request_t::SET_POSE;
  if (!puts && !changes_world(applied.kind)) return;
  size_t& count = puts ? poses_ : others_;
  if (count++ < kMostEdits) edits_.push_back({end_us_, std::move(applied)});
}

}  // namespace ruedo::log
