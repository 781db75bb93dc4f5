// Every length is checked against the bytes that are there before it is used.
#include "log/mcap_reader.h"

#include <cstdio>
#include <cstring>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <zstd.h>

#include "base/crc32.h"
#include "base/input_file.h"
#include "base/message_size.h"
#include "ruedo/errors.h"

namespace ruedo::log {
namespace {

enum Op : uint8_t {
  kSchema = 3,
  kChannel = 4,
  kMessage = 5,
  kChunk = 6,
  kAttachment = 9,
  kDataEnd = 15
};
constexpr char kMagic[] = "\x89MCAP0\r\n";
constexpr size_t kMagicSize = sizeof kMagic - 1, kRecordHead = 9;
constexpr uint64_t kMostAttachmentHead = 65536;        // bytes of its name and the like
constexpr uint64_t kMostRecord = 2 * kLargestMessage;  // bytes: of a chunk, whose last may be one
constexpr uint64_t kMostNames = 64u << 20;             // bytes, of all schemas and channels

// The fields of a record; after a fault everything is empty.
class Fields {
 public:
  explicit Fields(std::span<const uint8_t> bytes) : rest_(bytes) {}

  template <class Number>
  Number number() {
    uint64_t value = 0;
    const std::span<const uint8_t> bytes = take(sizeof(Number));
    for (size_t i = bytes.size(); i-- > 0;) value = value << 8 | bytes[i];
    return static_cast<Number>(value);
  }
  std::string text() {
    const std::span<const uint8_t> bytes = take(number<uint32_t>());
    return {bytes.begin(), bytes.end()};
  }
  std::map<std::string, std::string> texts() {
    Fields list(take(number<uint32_t>()));
    std::map<std::string, std::string> found;
    while (list.good_ && !list.rest_.empty()) {
      const std::string key = list.text();
      found[key] = list.text();
    }
    good_ &= list.good_;
    return found;
  }
  std::span<const uint8_t> take(uint64_t count) {
    good_ &= count <= rest_.size();
    if (!good_) return {};
    const std::span<const uint8_t> taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }
  std::span<const uint8_t> rest() const { return rest_; }
  bool good() const { return good_; }

 private:
  std::span<const uint8_t> rest_;
  bool good_ = true;
};

class McapFile {
 public:
  McapFile(const std::string& path, const McapHandler& handler) : path_(path), handler_(handler) {
    InputFile input = open_input(path);
    file_ = std::move(input.file);
    size_ = static_cast<uint64_t>(input.size);
  }

  void read() {
    if (bytes(kMagicSize) != std::vector<uint8_t>(kMagic, kMagic + kMagicSize))
      throw InputError({path_}, "is not an MCAP file");
    while (true) {
      begin_ = offset_;
      const std::vector<uint8_t> head = bytes(kRecordHead);
      const uint8_t op = head[0];
      const auto size = Fields(std::span(head).subspan(1)).number<uint64_t>();
      if (size > size_ - offset_) damaged("is cut off");
      const uint64_t end = offset_ + size;
      if (op == kDataEnd) return;
      if (op == kAttachment) {
        read_attachment(size);
      } else if (op == kChunk) {
        read_chunk(record(size));
      } else if (op == kSchema || op == kChannel || op == kMessage) {
        read_record(op, record(size));
      }
      offset_ = end;
      if (fseeko(file_.get(), static_cast<off_t>(end), SEEK_SET) != 0) damaged("cannot be read");
    }
  }

 private:
  [[noreturn]] void damaged(const std::string& what) const {
    throw InputError({path_}, fmt::format("{} at byte {}", what, begin_));
  }

  // A sparse file has room for a length that lies, and takes none on the disk.
  std::vector<uint8_t> record(uint64_t size) {
    if (size > kMostRecord)
      damaged(fmt::format("has a record of {} bytes (at most {} are allowed)", size, kMostRecord));
    return bytes(size);
  }

  std::vector<uint8_t> bytes(uint64_t count) {
    if (count > size_ - offset_) damaged("is cut off");
    std::vector<uint8_t> read(count);
    if (std::fread(read.data(), 1, count, file_.get()) != count) damaged("cannot be read");
    offset_ += count;
    return read;
  }

  void read_attachment(uint64_t size) {
    const uint64_t begin = offset_;
    const std::vector<uint8_t> head = bytes(std::min(size, kMostAttachmentHead));
    Fields fields(head);
    fields.take(16);  // times
    const std::string name = fields.text();
    fields.text();  // media type
    const auto data_size = fields.number<uint64_t>();
    const uint64_t before = head.size() - fields.rest().size();
    if (!fields.good() || data_size > size - before) damaged("has a damaged attachment");
    if (handler_.attachment) handler_.attachment(name, begin + before, data_size);
  }

  void read_chunk(const std::vector<uint8_t>& record) {
    Fields fields(record);
    fields.take(16);  // times
    const auto size = fields.number<uint64_t>();
    const auto crc = fields.number<uint32_t>();
    const std::string compression = fields.text();
    std::span<const uint8_t> all = fields.take(fields.number<uint64_t>());
    if (!fields.good()) damaged("has a damaged chunk");
    if (compression == "zstd")
      all = unpacked(all, size);
    else if (!compression.empty())
      throw InputError({path_}, "is compressed by " + compression +
                                    "; allowed is zstd: `mcap compress --compression zstd` makes "
                                    "such a file");
    if (crc != 0 && crc32(all.data(), all.size()) != crc)
      damaged("has a chunk whose CRC-32 is wrong");
    Fields records(all);
    while (!records.rest().empty()) {
      const auto op = records.number<uint8_t>();
      const std::span<const uint8_t> one = records.take(records.number<uint64_t>());
      if (!records.good()) damaged("has a damaged chunk");
      read_record(op, one);
    }
  }

  // size: as the chunk says.
  std::span<const uint8_t> unpacked(std::span<const uint8_t> packed, uint64_t size) {
    if (size > kMostRecord)
      damaged(fmt::format("has a chunk of {} bytes (at most {} are allowed)", size, kMostRecord));
    unpacked_.resize(size);
    if (ZSTD_decompress(unpacked_.data(), size, packed.data(), packed.size()) != size)
      damaged("has a chunk that is not what was written (zstd)");
    return unpacked_;
  }

  void read_record(uint8_t op, std::span<const uint8_t> record) {
    Fields fields(record);
    const auto id = fields.number<uint16_t>();
    if (op == kSchema || op == kChannel) note_names(op, id, record.size());
    if (op == kSchema) {
      schemas_[id] = fields.text();
    } else if (op == kChannel) {
      McapChannel channel;
      channel.type = schemas_[fields.number<uint16_t>()];
      channel.topic = fields.text();
      channel.encoding = fields.text();
      channel.metadata = fields.texts();
      channels_[id] = std::move(channel);
    } else if (op == kMessage) {
      fields.number<uint32_t>();  // its place in the channel
      const auto time_ns = fields.number<uint64_t>();
      fields.number<uint64_t>();  // when it was sent
      const auto channel = channels_.find(id);
      if (channel == channels_.end()) damaged("has a message of no channel");
      if (fields.good() && handler_.message)
        handler_.message(channel->second, time_ns, fields.rest());
    }
    if (!fields.good()) damaged("has a damaged record");
  }

  // Kept once: other writers repeat a schema with each chunk.
  void note_names(uint8_t op, uint16_t id, uint64_t size) {
    uint64_t& kept = names_[{op, id}];
    all_names_ += size - std::exchange(kept, size);
    if (all_names_ > kMostNames)
      damaged(fmt::format("has more than {} bytes of schemas and channels", kMostNames));
  }

  const std::string& path_;
  const McapHandler& handler_;
  std::unique_ptr<std::FILE, InputFile::Close> file_;
  uint64_t size_ = 0, offset_ = 0, begin_ = 0;              // begin_: of the record
  std::map<std::pair<uint8_t, uint16_t>, uint64_t> names_;  // bytes, by operation and id
  uint64_t all_names_ = 0;
  std::vector<uint8_t> unpacked_;  // of a chunk
  std::map<uint16_t, std::string> schemas_;
  std::map<uint16_t, McapChannel> channels_;
};

}  // namespace

void read_mcap(const std::string& path, const McapHandler& handler) {
  McapFile(path, handler).read();
}

bool is_mcap(const std::string& path) {
  char begin[kMagicSize] = {};
  try {
    return std::fread(begin, 1, kMagicSize, open_input(path).file.get()) == kMagicSize &&
           std::memcmp(begin, kMagic, kMagicSize) == 0;
  } catch (const InputError&) {
    return false;
  }
}

}  // namespace ruedo::log
