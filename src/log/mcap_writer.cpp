// Records are an operation (1 byte), a length (8 bytes) and their fields, all little endian; texts
// and lists have their length in bytes before them (4 bytes).
#include "log/mcap_writer.h"

#include <algorithm>

#include <zstd.h>

#include "base/crc32.h"
#include "base/input_file.h"
#include "base/version.h"
#include "ruedo/errors.h"

namespace ruedo::log {
namespace {

enum class Op : uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  message_index = 7,
  chunk_index = 8,
  attachment = 9,
  attachment_index = 10,
  statistics = 11,
  summary_offset = 14,
  data_end = 15,
};
constexpr std::string_view kMagic = "\x89MCAP0\r\n", kCompression = "zstd";
constexpr int kLevel = 1;  // the fastest: a log costs more to read than to compress

template <class Number>
void put(std::string& bytes, Number value) {
  for (size_t i = 0; i < sizeof value; ++i)
    bytes += static_cast<char>(static_cast<uint64_t>(value) >> (8 * i));
}
void put_text(std::string& bytes, std::string_view text) {
  put(bytes, static_cast<uint32_t>(text.size()));
  bytes += text;
}
template <class Value>
void put_map(std::string& bytes, const std::map<uint16_t, Value>& map) {
  put(bytes, static_cast<uint32_t>(map.size() * (sizeof(uint16_t) + sizeof(Value))));
  for (const auto& [key, value] : map) put(bytes, key), put(bytes, value);
}
std::string record(Op op, std::string_view fields) {
  std::string bytes;
  bytes.reserve(9 + fields.size());
  bytes += static_cast<char>(op);
  put(bytes, static_cast<uint64_t>(fields.size()));
  bytes += fields;
  return bytes;
}

// CRC-32 continues from a part to the next.
uint32_t crc_of(std::string_view bytes, uint32_t before = 0) {
  return crc32(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size(), before);
}

}  // namespace

class McapWriter::Compressor {
 public:
  // Valid until the next call.
  std::string_view pack(std::string_view bytes) {
    packed_.resize(ZSTD_compressBound(bytes.size()));
    const size_t size = ZSTD_compressCCtx(context_.get(), packed_.data(), packed_.size(),
                                          bytes.data(), bytes.size(), kLevel);
    if (ZSTD_isError(size)) throw EnvironmentError(std::string("zstd: ") + ZSTD_getErrorName(size));
    return {packed_.data(), size};
  }

 private:
  struct Free {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };
  std::unique_ptr<ZSTD_CCtx, Free> context_{ZSTD_createCCtx()};
  std::vector<char> packed_;
};

McapWriter::McapWriter(const std::string& path, const std::string& profile)
    : path_(path), file_(path), compressor_(std::make_unique<Compressor>()) {
  write(kMagic);
  std::string fields;
  put_text(fields, profile);
  put_text(fields, std::string("Ruedo ") + version());
  write(record(Op::header, fields));
}

McapWriter::~McapWriter() = default;

void McapWriter::write(std::string_view bytes) {
  file_.write(bytes);
  offset_ += bytes.size();
  crc_ = crc_of(bytes, crc_);
}

uint16_t McapWriter::add_schema(const std::string& name, const std::string& encoding,
                                std::string_view data) {
  if (schemas_.size() >= kMostIds)
    throw InputError({path_}, "has no room for more than 65535 schemas");
  const auto id = static_cast<uint16_t>(schemas_.size() + 1);
  std::string fields;
  put(fields, id);
  put_text(fields, name);
  put_text(fields, encoding);
  put_text(fields, data);
  schemas_.push_back(record(Op::schema, fields));
  chunk_ += schemas_.back();
  return id;
}

uint16_t McapWriter::add_channel(uint16_t schema, const std::string& topic,
                                 const std::string& encoding, const Metadata& metadata) {
  if (channels_.size() >= kMostIds)
    throw InputError({path_}, "has no room for more than 65535 channels");
  const auto id = static_cast<uint16_t>(channels_.size() + 1);
  std::string fields;
  put(fields, id);
  put(fields, schema);
  put_text(fields, topic);
  put_text(fields, encoding);
  std::string map;
  for (const auto& [key, value] : metadata) put_text(map, key), put_text(map, value);
  put_text(fields, map);
  channels_.push_back(record(Op::channel, fields));
  chunk_ += channels_.back();
  return id;
}

void McapWriter::add_message(uint16_t channel, uint64_t time_ns, std::string_view data) {
  const bool first = index_.empty();
  chunk_begin_ns_ = first ? time_ns : std::min(chunk_begin_ns_, time_ns);
  chunk_end_ns_ = first ? time_ns : std::max(chunk_end_ns_, time_ns);
  begin_ns_ = messages_ == 0 ? time_ns : std::min(begin_ns_, time_ns);
  end_ns_ = std::max(end_ns_, time_ns);
  index_[channel].push_back({time_ns, chunk_.size()});
  std::string fields;
  put(fields, channel);
  put(fields, sequences_[channel]++);
  put(fields, time_ns);  // logged
  put(fields, time_ns);  // published
  chunk_ += static_cast<char>(Op::message);
  put(chunk_, static_cast<uint64_t>(fields.size() + data.size()));
  chunk_ += fields;
  chunk_ += data;
  ++counts_[channel];
  ++messages_;
  if (chunk_.size() >= kChunkSize) end_chunk();
}

void McapWriter::end_chunk() {
  if (index_.empty()) return;
  const std::string_view packed = compressor_->pack(chunk_);
  std::string times;
  put(times, chunk_begin_ns_);
  put(times, chunk_end_ns_);
  std::string fields = times;
  put(fields, static_cast<uint64_t>(chunk_.size()));
  put(fields, crc_of(chunk_));
  put_text(fields, kCompression);
  put(fields, static_cast<uint64_t>(packed.size()));
  fields += packed;
  const uint64_t begin = offset_;
  write(record(Op::chunk, fields));
  const uint64_t indexes = offset_;
  std::map<uint16_t, uint64_t> index_offsets;
  for (const auto& [channel, entries] : index_) {
    index_offsets[channel] = offset_;
    std::string list;
    put(list, channel);
    put(list, static_cast<uint32_t>(entries.size() * sizeof(IndexEntry)));
    for (const IndexEntry& entry : entries) put(list, entry.time_ns), put(list, entry.offset);
    write(record(Op::message_index, list));
  }
  std::string index = times;
  put(index, begin);
  put(index, indexes - begin);
  put_map(index, index_offsets);
  put(index, offset_ - indexes);
  put_text(index, kCompression);
  put(index, static_cast<uint64_t>(packed.size()));
  put(index, static_cast<uint64_t>(chunk_.size()));
  chunk_indexes_.push_back(record(Op::chunk_index, index));
  chunk_.clear();
  index_.clear();
}

void McapWriter::add_attachment(const std::string& name, const std::string& media_type,
                                const std::string& path) {
  end_chunk();
  const InputFile input = open_input(path);
  const auto size = static_cast<uint64_t>(input.size);
  std::string fields;
  put(fields, uint64_t{0});  // logged: from the beginning on
  put(fields, uint64_t{0});  // a bag's bytes must not depend on when it was made
  put_text(fields, name);
  put_text(fields, media_type);
  put(fields, size);
  const uint64_t offset = offset_;
  std::string head(1, static_cast<char>(Op::attachment));
  put(head, static_cast<uint64_t>(fields.size() + size + sizeof(uint32_t)));
  write(head);
  write(fields);
  uint32_t crc = crc_of(fields);
  std::vector<char> part(kChunkSize);
  for (uint64_t left = size; left > 0;) {
    const size_t count =
        std::fread(part.data(), 1, std::min<uint64_t>(left, part.size()), input.file.get());
    if (count == 0) throw EnvironmentError(path + " became shorter while it was read");
    write({part.data(), count});
    crc = crc_of({part.data(), count}, crc);
    left -= count;
  }
  std::string end;
  put(end, crc);
  write(end);
  attachments_.push_back({name, media_type, offset, offset_ - offset, size});
}

std::vector<std::string> McapWriter::attachment_indexes() const {
  std::vector<std::string> indexes;
  for (const Attachment& attachment : attachments_) {
    std::string fields;
    for (const uint64_t value : {attachment.offset, attachment.size, uint64_t{0}, uint64_t{0}})
      put(fields, value);
    put(fields, attachment.data_size);
    put_text(fields, attachment.name);
    put_text(fields, attachment.media_type);
    indexes.push_back(record(Op::attachment_index, fields));
  }
  return indexes;
}

void McapWriter::write_summary() {
  const uint64_t begin = offset_;
  std::string offsets;
  crc_ = 0;  // of the summary from here on
  const auto group = [&](Op op, const std::vector<std::string>& records) {
    const uint64_t from = offset_;
    for (const std::string& each : records) write(each);
    if (records.empty()) return;
    std::string fields;
    fields += static_cast<char>(op);
    put(fields, from);
    put(fields, offset_ - from);
    offsets += record(Op::summary_offset, fields);
  };
  group(Op::schema, schemas_);
  group(Op::channel, channels_);
  std::string statistics;
  put(statistics, messages_);
  put(statistics, static_cast<uint16_t>(schemas_.size()));
  put(statistics, static_cast<uint32_t>(channels_.size()));
  put(statistics, static_cast<uint32_t>(attachments_.size()));
  put(statistics, uint32_t{0});  // metadata
  put(statistics, static_cast<uint32_t>(chunk_indexes_.size()));
  put(statistics, begin_ns_);
  put(statistics, end_ns_);
  put_map(statistics, counts_);
  group(Op::statistics, {record(Op::statistics, statistics)});
  group(Op::chunk_index, chunk_indexes_);
  group(Op::attachment_index, attachment_indexes());
  const uint64_t offsets_begin = offset_;
  write(offsets);
  std::string footer;
  put(footer, begin);
  put(footer, offsets_begin);
  std::string head = record(Op::footer, footer);
  head[1] =
      static_cast<char>(footer.size() + sizeof(uint32_t));  // its length counts the checksum, too
  put(footer, crc_of(head, crc_));
  write(record(Op::footer, footer));
}

void McapWriter::finish() {
  end_chunk();
  std::string data_end;
  put(data_end, crc_);
  write(record(Op::data_end, data_end));
  write_summary();
  write(kMagic);
  file_.keep();
}

}  // namespace ruedo::log
