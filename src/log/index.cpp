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

namespace {

// Places that a channel has in memory before they are written; fewer where channels are many.
size_t page_of(size_t channel) { return channel < 1024 ? 512 : 64; }

}  // namespace

Index::Index(const std::string& path, Keeps keeps) : keeps_(keeps) {
  Reader reader(path, "indexing");
  Event event;
  std::unordered_map<std::string, size_t> known;  // looked up only
  const auto wanted = [&](const std::string& channel) {
    return channel == kAppliedChannel || !known.contains(channel);
  };
  const auto file = std::make_shared<PlacesFile>();
  bool crowded = false;
  for (int64_t offset = 0; reader.next(event, wanted); offset = reader.offset()) {
    if (channels_.size() == kMostChannels && !known.contains(event.channel)) {
      crowded = true;
      continue;
    }
    const auto [at, fresh] = known.try_emplace(event.channel, channels_.size());
    if (channels_.empty()) begin_us_ = end_us_ = event.timestamp_us;
    if (fresh)
      channels_.push_back(
          {event.channel, fingerprint_of(event.data), 0, Places(file, page_of(channels_.size()))});
    add(event, offset, reader.offset(), at->second);
  }
  if (!reader.fault().empty()) fault_ = reader.fault();
  if (crowded && fault_.empty())
    fault_ =
        "has more than " + std::to_string(kMostChannels) + " channels: the others are not shown";
  if (channels_.empty())
    throw InputError({path}, "holds no message" + (fault_.empty() ? "" : ": " + fault_));
  if (header_) find_files_again(*header_, path);
}

void Index::add(const Event& event, int64_t offset, int64_t end, size_t channel) {
  Channel& of = channels_[channel];
  if (of.bytes == 0 && event.channel == kHeaderChannel) {
    log_header_t header;
    if (decode_checked(event.data.data(), event.data.size(), header) == DecodeFault::none)
      header_ = std::move(header);
  }
  end_us_ = std::max(end_us_, event.timestamp_us);
  of.bytes += end - offset;
  if (keeps_ == Keeps::places)
    of.places.push_back({end_us_, offset, static_cast<uint32_t>(end - offset)});
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
