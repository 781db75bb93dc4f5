// Hears ruedo/info beside the server's own channels, and compares run ids.
#include "bus/rival_watch.h"

#include <algorithm>
#include <optional>

#include "base/big_endian.h"
#include "base/channel_names.h"
#include "base/utf8.h"
#include "ruedo/decode.h"
#include "ruedo/world_info_t.hpp"

namespace ruedo::bus {
namespace {

constexpr size_t kMostRivals = 8;  // are reported

std::vector<std::string> with_info(std::vector<std::string> channels) {
  channels.push_back(kInfoChannel);
  return channels;
}

// Behind the fingerprint and utime.
int64_t run_id_of(const uint8_t* data, size_t size) {
  return size < 24 ? 0 : read_big_endian<int64_t>(data + 16);
}

}  // namespace

RivalWatch::RivalWatch(std::unique_ptr<Bus> bus, std::function<void(const std::string&)> say)
    : bus_(std::move(bus)), say_(std::move(say)) {}

void RivalWatch::publish(const std::string& channel, const uint8_t* data, size_t size) {
  if (run_id_ == 0 && channel == kInfoChannel) run_id_ = run_id_of(data, size);
  bus_->publish(channel, data, size);
}

void RivalWatch::listen(const std::vector<std::string>& channels, Handler handler,
                        const std::vector<std::string>& own) {
  bus_->listen(
      with_info(channels),
      [this, handler = std::move(handler)](const std::string& channel, const uint8_t* data,
                                           size_t size) {
        if (channel == kInfoChannel) {
          heard(data, size);
        } else {
          handler(channel, data, size);
        }
      },
      own);
}

void RivalWatch::listen_to(const std::vector<std::string>& channels,
                           const std::vector<std::string>& own) {
  bus_->listen_to(with_info(channels), own);
}

void RivalWatch::heard(const uint8_t* data, size_t size) {
  if (run_id_ == 0) return;  // the rival repeats it when our own id is known
  const int64_t id = run_id_of(data, size);
  if (id == run_id_ || rivals_.size() >= kMostRivals ||
      std::find(rivals_.begin(), rivals_.end(), id) != rivals_.end())
    return;
  world_info_t info;
  if (decode_checked(data, size, info) != DecodeFault::none) return;
  rivals_.push_back(id);
  say_("another server is on this channel: run " + std::to_string(id) + ", world " +
       in_one_line(for_terminal(shortened(info.world, 100))) + "; this one is run " +
       std::to_string(run_id_) +
       ". Their messages mix: start one of them with another --lcm port (shown once)");
}

}  // namespace ruedo::bus
