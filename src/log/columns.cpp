// The schema checks the whole message before its values are read: then all lengths are valid.
#include "log/columns.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <new>

#include "base/big_endian.h"
#include "base/wire_size.h"
#include "log/reader.h"

namespace ruedo::log {
namespace {

constexpr size_t kFingerprint = 8;
constexpr int64_t kPollBytes = 1 << 22;

template <class Word>
void swap_words(const uint8_t* from, std::byte* to, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    Word word;
    std::memcpy(&word, from + i * sizeof word, sizeof word);
    if constexpr (std::endian::native == std::endian::little) {
      if constexpr (sizeof word == 2) word = __builtin_bswap16(word);
      if constexpr (sizeof word == 4) word = __builtin_bswap32(word);
      if constexpr (sizeof word == 8) word = __builtin_bswap64(word);
    }
    std::memcpy(to + i * sizeof word, &word, sizeof word);
  }
}

void to_host_order(const uint8_t* from, std::byte* to, size_t count, size_t size) {
  switch (size) {
    case 2: return swap_words<uint16_t>(from, to, count);
    case 4: return swap_words<uint32_t>(from, to, count);
    case 8: return swap_words<uint64_t>(from, to, count);
    default: std::memcpy(to, from, count);
  }
}

int64_t integer_of(Primitive type, const uint8_t* bytes) {
  switch (type) {
    case Primitive::int8: return static_cast<int8_t>(*bytes);
    case Primitive::byte: return *bytes;
    case Primitive::int16: return read_big_endian<int16_t>(bytes);
    case Primitive::int32: return read_big_endian<int32_t>(bytes);
    case Primitive::int64: return read_big_endian<int64_t>(bytes);
    default: return 0;
  }
}

}  // namespace

void GrowingBytes::Free::operator()(std::byte* bytes) const { std::free(bytes); }

std::byte* GrowingBytes::grow(size_t size) {
  if (size_ + size > room_) {
    const size_t room = std::max(size_ + size, room_ + room_ / 4 + 64);
    std::byte* const old = bytes_.release();
    void* bytes = std::realloc(old, room);  // of much memory: moves pages, copies nothing
    bytes_.reset(bytes == nullptr ? old : static_cast<std::byte*>(bytes));
    if (bytes == nullptr) throw std::bad_alloc();
    room_ = room;
  }
  size_ += size;
  return bytes_.get() + (size_ - size);
}

void GrowingBytes::append(int64_t value) { std::memcpy(grow(sizeof value), &value, sizeof value); }

std::byte* GrowingBytes::release() {
  if (size_ == 0) return nullptr;
  std::byte* const old = bytes_.release();
  void* bytes = std::realloc(old, size_);
  if (bytes == nullptr) {
    bytes_.reset(old);
    throw std::bad_alloc();
  }
  size_ = room_ = 0;
  return static_cast<std::byte*>(bytes);
}

bool Table::fits(const Schema& schema) {
  for (const Field& field : schema.fields) {
    if (field.primitive == Primitive::none) return false;
    for (size_t i = 1; i < field.dimensions.size(); ++i) {
      if (field.dimensions[i].counted_by.valid()) return false;
    }
  }
  return true;
}

Table::Table(const Schema& schema) : schema_(&schema), counts_(schema.fields.size(), 0) {
  for (const Field& field : schema.fields) {
    columns_.push_back({field.name, field.primitive, {}, {}, {}, {}});
    for (const Dimension& dimension : field.dimensions)
      columns_.back().shape.push_back(dimension.size);
  }
}

bool Table::add(std::span<const uint8_t> message) {
  if (!well_formed(*schema_, message)) return false;
  std::span<const uint8_t> rest = message.subspan(kFingerprint);
  for (size_t i = 0; i < columns_.size(); ++i) {
    const Field& field = schema_->fields[FieldIndex(i)];
    if (field.dimensions.empty()) counts_[i] = integer_of(field.primitive, rest.data());
    add_field(field, columns_[i], rest);
  }
  ++messages_;
  return true;
}

void Table::add_field(const Field& field, Column& column, std::span<const uint8_t>& rest) {
  int64_t count = 1;
  for (const Dimension& dimension : field.dimensions)
    count *= dimension.counted_by.valid() ? counts_[static_cast<size_t>(dimension.counted_by)]
                                          : dimension.size;
  if (!field.dimensions.empty()) note_count(field, column, count);
  if (field.primitive != Primitive::string) {
    const size_t size = wire_size(field.primitive), values = static_cast<size_t>(count);
    to_host_order(rest.data(), column.values.grow(values * size), values, size);
    rest = rest.subspan(values * size);
    return;
  }
  for (int64_t k = 0; k < count; ++k) {  // its length counts the zero at its end
    const auto length = static_cast<size_t>(read_big_endian<uint32_t>(rest.data()));
    std::memcpy(column.values.grow(length - 1), rest.data() + 4, length - 1);
    column.text_ends.append(static_cast<int64_t>(column.values.size()));
    rest = rest.subspan(4 + length);
  }
}

// As long as all messages have as many values, their shape says where each begins.
void Table::note_count(const Field& field, Column& column, int64_t count) const {
  if (!field.dimensions[0].counted_by.valid()) return;
  int64_t inner = 1;
  for (size_t i = 1; i < column.shape.size(); ++i) inner *= column.shape[i];
  const int64_t first = counts_[static_cast<size_t>(field.dimensions[0].counted_by)];
  if (messages_ == 0) column.shape[0] = first;
  if (column.shape[0] == first) return;
  int64_t end = 0;
  if (column.shape[0] >= 0) {
    for (int64_t k = 0; k < messages_; ++k) column.ends.append(end += column.shape[0] * inner);
    column.shape[0] = -1;
  } else {
    std::memcpy(&end, column.ends.data() + column.ends.size() - sizeof end, sizeof end);
  }
  column.ends.append(end + count);
}

Columns read_columns(const std::string& path, const ColumnRequest& request) {
  Columns columns;
  Reader reader(path);
  if (request.begin_us > std::numeric_limits<SimTime>::min()) reader.seek_time(request.begin_us);
  Event event;
  int64_t polled = reader.offset();
  while (reader.next(event, request.wanted) && event.timestamp_us <= request.end_us) {
    if (request.poll && reader.offset() - polled > kPollBytes) {
      polled = reader.offset();
      request.poll();
    }
    if (event.timestamp_us < request.begin_us || event.data.empty()) continue;
    auto table = columns.tables.find(event.channel);
    if (table == columns.tables.end()) {
      const Schema* schema = find_schema(fingerprint_of(event.data));
      if (schema == nullptr) continue;
      if (!Table::fits(*schema)) {
        if (request.other) request.other(event.channel, event.data);
        continue;
      }
      table = columns.tables.emplace(event.channel, *schema).first;
    }
    table->second.add(event.data);
  }
  columns.fault = reader.fault();
  return columns;
}

}  // namespace ruedo::log
