// Writes MCAP files (mcap.dev/spec): messages in chunks, compressed by zstd, with their indexes, a
// summary, and checksums.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "system/output_file.h"

namespace ruedo::log {

class McapWriter {
 public:
  static constexpr size_t kChunkSize =
      size_t{4} << 20;                       // bytes; a chunk ends with the message that passes it
  static constexpr size_t kMostIds = 65535;  // schemas, and channels

  using Metadata = std::map<std::string, std::string>;

  // profile: MCAP's name of the conventions, "ros2". Throws as OutputFile, as all functions below.
  // An older file at the path stays until finish().
  explicit McapWriter(const std::string& path, const std::string& profile = "");
  ~McapWriter();

  // Both return an id. Throw InputError when there are too many.
  uint16_t add_schema(const std::string& name, const std::string& encoding, std::string_view data);
  uint16_t add_channel(uint16_t schema, const std::string& topic, const std::string& encoding,
                       const Metadata& metadata = {});
  void add_message(uint16_t channel, uint64_t time_ns, std::string_view data);
  // A file, whole. No message may follow.
  void add_attachment(const std::string& name, const std::string& media_type,
                      const std::string& path);
  void finish();

  uint64_t messages() const { return messages_; }
  uint64_t size() const { return offset_; }  // bytes written

 private:
  struct IndexEntry {
    uint64_t time_ns, offset;
  };
  class Compressor;

  struct Attachment {
    std::string name, media_type;
    uint64_t offset, size, data_size;
  };

  void write(std::string_view bytes);
  void end_chunk();
  void write_summary();
  std::vector<std::string> attachment_indexes() const;

  std::string path_;
  OutputFile file_;
  uint64_t offset_ = 0;
  uint32_t crc_ = 0;                             // of all that was written
  std::vector<std::string> schemas_, channels_;  // records
  std::map<uint16_t, uint64_t> counts_;          // messages of each channel
  std::map<uint16_t, uint32_t> sequences_;
  std::string chunk_;  // records of the chunk that is open
  std::map<uint16_t, std::vector<IndexEntry>> index_;
  uint64_t chunk_begin_ns_ = 0, chunk_end_ns_ = 0, begin_ns_ = 0, end_ns_ = 0, messages_ = 0;
  std::unique_ptr<Compressor> compressor_;
  std::vector<std::string> chunk_indexes_;  // records
  std::vector<Attachment> attachments_;
};

}  // namespace ruedo::log
