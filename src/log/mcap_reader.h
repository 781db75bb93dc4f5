// Reads MCAP files (mcap.dev/spec) from one end to the other: messages in the file's order, and
// attachments. Of files that are compressed by zstd, or not at all.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>

namespace ruedo::log {

struct McapChannel {
  std::string topic, type, encoding;  // type: its schema's name
  std::map<std::string, std::string> metadata;
};

struct McapHandler {
  std::function<void(const McapChannel&, uint64_t time_ns, std::span<const uint8_t>)> message;
  // Its bytes are the file's from `offset` on.
  std::function<void(const std::string& name, uint64_t offset, uint64_t size)> attachment;
};

// Either of the two may be empty. Throws InputError for what is no such file, is compressed
// otherwise, damaged or cut off: with the place.
void read_mcap(const std::string& path, const McapHandler& handler);

// Whether it begins as MCAP files do.
bool is_mcap(const std::string& path);

}  // namespace ruedo::log
