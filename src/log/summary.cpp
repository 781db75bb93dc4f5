// One pass over the heads of the events: of each channel only the first message's data is read.
#include "log/summary.h"

#include <algorithm>
#include <array>
#include <unordered_map>

#include "base/big_endian.h"
#include "base/input_file.h"
#include "base/lcm_log.h"
#include "log/header.h"
#include "log/reader.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/schema.h"

namespace ruedo::log {

double ChannelSummary::rate() const {
  return last_us > first_us
             ? static_cast<double>(messages - 1) / (static_cast<double>(last_us - first_us) * 1e-6)
             : 0.0;
}

bool is_log(const std::string& path) {
  std::array<uint8_t, 4> sync{};
  try {
    const InputFile in = open_to_look(path);
    return std::fread(sync.data(), 1, sync.size(), in.file.get()) == sync.size() &&
           read_big_endian<uint32_t>(sync.data()) == kLogSync;
  } catch (const InputError&) {
    return false;
  }
}

Summary summarize(const std::string& path) {
  Reader reader(path);
  Summary summary;
  summary.size = reader.size();
  std::unordered_map<std::string, size_t> known;
  const auto is_new = [&](const std::string& channel) { return !known.contains(channel); };
  Event event;
  for (int64_t begin = 0; reader.next(event, is_new); begin = reader.offset()) {
    summary.readable = reader.offset();
    if (summary.messages++ == 0) summary.begin_us = summary.end_us = event.timestamp_us;
    summary.begin_us = std::min(summary.begin_us, event.timestamp_us);
    summary.end_us = std::max(summary.end_us, event.timestamp_us);
    if (known.size() == Summary::kMostChannels && is_new(event.channel)) continue;
    const auto [at, fresh] = known.try_emplace(event.channel, summary.channels.size());
    if (fresh) {
      const int64_t fingerprint = fingerprint_of(event.data);
      const Schema* schema = find_schema(fingerprint);
      summary.channels.push_back({event.channel, fingerprint, schema ? schema->name : "", 0, 0,
                                  event.timestamp_us, event.timestamp_us});
      log_header_t header;
      if (event.channel == kHeaderChannel &&
          decode_checked(event.data.data(), event.data.size(), header) == DecodeFault::none)
        summary.header = std::move(header);
    }
    ChannelSummary& channel = summary.channels[at->second];
    ++channel.messages;
    channel.bytes += reader.offset() - begin - static_cast<int64_t>(kLogHeadSize) -
                     static_cast<int64_t>(event.channel.size());
    channel.last_us = std::max(channel.last_us, event.timestamp_us);
  }
  summary.fault = reader.fault();
  std::sort(summary.channels.begin(), summary.channels.end(),
            [](const ChannelSummary& a, const ChannelSummary& b) { return a.name < b.name; });
  return summary;
}

}  // namespace ruedo::log
