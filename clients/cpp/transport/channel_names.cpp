#include "transport/channel_names.h"

#include <utility>

#include "samples/world_info.h"

namespace ruedo::client {
namespace {

constexpr size_t kMostBytes = 16 << 20;  // of the changes

std::vector<std::string> names_of(const WorldInfo& info) {
  std::vector<std::string> names;
  names.reserve(info.channel_list.size());
  for (const ChannelInfo& channel : info.channel_list) names.push_back(channel.name);
  return names;
}

}  // namespace

void ChannelNames::begin(const WorldInfo& info) {
  names_ = newest_ = names_of(info);
  newest_utime_ = info.utime;
  changes_.clear();
  bytes_ = 0;
}

void ChannelNames::change(const WorldInfo& info) {
  if (info.utime < newest_utime_) return;  // it was on its way for longer than the next one
  newest_utime_ = info.utime;
  std::vector<std::string> names = names_of(info);
  newest_.resize(names.size());
  for (size_t i = 0; i < names.size(); ++i) {
    if (names[i] == newest_[i]) continue;
    bytes_ += sizeof(Change) + names[i].size();
    changes_.push_back({info.utime, i, names[i]});
  }
  newest_ = std::move(names);
  while (bytes_ > kMostBytes) make_first();
}

void ChannelNames::go_to(int64_t utime) {
  while (!changes_.empty() && changes_.front().utime < utime) make_first();
}

const std::string& ChannelNames::of(size_t channel) const {
  static const std::string kUnknown;
  if (channel < names_.size() && !names_[channel].empty()) return names_[channel];
  for (const Change& change : changes_)
    if (change.channel == channel && !change.name.empty()) return change.name;
  return kUnknown;
}

void ChannelNames::make_first() {
  Change& first = changes_.front();
  bytes_ -= sizeof(Change) + first.name.size();
  if (first.channel >= names_.size()) names_.resize(first.channel + 1);
  names_[first.channel] = std::move(first.name);
  changes_.pop_front();
}

}  // namespace ruedo::client
