// Messages that belong together are recognised by the description of their type: a type with a
// field `part` comes in parts.
#include "console/board.h"

#include "console/drawn.h"
#include "core/utf8.h"
#include "core/wire_size.h"
#include "ruedo/schema.h"

namespace ruedo::console {
namespace {

// The offset of the field `part`, an int16, in a message; -1 if there is none, or if its offset
// varies.
int part_offset(const Schema& schema) {
  int at = 8;  // after the fingerprint
  for (const Field& field : schema.fields) {
    if (field.name == "part" && field.primitive == Primitive::int16) return at;
    const auto size = static_cast<int>(wire_size(field.primitive));
    if (size == 0 || !field.dimensions.empty()) return -1;
    at += size;
  }
  return -1;
}

}  // namespace

void Board::name(size_t channel, const std::string& name) {
  if (channel >= channels_.size()) channels_.resize(channel + 1);
  channels_[channel].name = printable(name);
}

void Board::put(size_t index, std::vector<uint8_t> message) {
  Channel& channel = channels_[index];
  const int64_t fingerprint = fingerprint_of(message);
  if (fingerprint != channel.fingerprint) {
    channel.fingerprint = fingerprint;
    const Schema* schema = find_schema(fingerprint);
    channel.part_at = schema ? part_offset(*schema) : -1;
    channel.replies = schema && schema->name == "reply_t";
    channel.layers = schema && schema->name == "markers_t";
    channel.newest.clear();
  }
  const auto at = static_cast<size_t>(channel.part_at);
  const bool later_part = channel.part_at >= 0 && message.size() >= at + 2 &&
                          (message[at] != 0 || message[at + 1] != 0);
  if (channel.replies) {
    if (channel.newest.size() >= kKeptReplies) channel.newest.erase(channel.newest.begin());
  } else if (channel.layers) {
    const std::string layer = layer_of(message);
    std::erase_if(channel.newest,
                  [&](const Message& before) { return layer_of(*before.bytes) == layer; });
    if (channel.newest.size() >= Drawn::kMostLayers) channel.newest.erase(channel.newest.begin());
  } else if (!later_part || channel.newest.size() >= kMostParts) {
    channel.newest.clear();
  }
  channel.last_number = ++number_;
  channel.newest.push_back(
      {number_, std::make_shared<const std::vector<uint8_t>>(std::move(message))});
}

bool Board::is_later_part(std::span<const uint8_t> message) {
  const Schema* schema = find_schema(fingerprint_of(message));
  const int offset = schema ? part_offset(*schema) : -1;
  const auto at = static_cast<size_t>(offset);
  return offset >= 0 && message.size() >= at + 2 && (message[at] != 0 || message[at + 1] != 0);
}

}  // namespace ruedo::console
