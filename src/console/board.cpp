// Messages that belong together are recognised by the description of their type: a type with a
// field `part` comes in parts.
#include "console/board.h"

#include "base/utf8.h"
#include "base/wire_size.h"
#include "console/drawn.h"
#include "ruedo/schema.h"

namespace ruedo::console {
namespace {

// The offset of the field `part`, an int16, in a message; none if there is no such field, or if its
// offset varies.
std::optional<size_t> part_offset(const Schema& schema) {
  size_t at = 8;  // after the fingerprint
  for (const Field& field : schema.fields) {
    if (field.name == "part" && field.primitive == Primitive::int16) return at;
    const size_t size = wire_size(field.primitive);
    if (size == 0 || !field.dimensions.empty()) return std::nullopt;
    at += size;
  }
  return std::nullopt;
}

// Whether it is a part, but not the first.
bool is_later(std::span<const uint8_t> message, std::optional<size_t> part_at) {
  return part_at && message.size() >= *part_at + 2 &&
         (message[*part_at] != 0 || message[*part_at + 1] != 0);
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
    channel.part_at = schema ? part_offset(*schema) : std::nullopt;
    channel.replies = schema && schema->name == "reply_t";
    channel.layers = schema && schema->name == "markers_t";
    channel.newest.clear();
  }
  const bool later_part = is_later(message, channel.part_at);
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
  return schema && is_later(message, part_offset(*schema));
}

}  // namespace ruedo::console
