// The messages of a log as columns: of each channel and each field the values of all messages, one
// after another, for NumPy and the like. The log is read once; memory is what is returned.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "ruedo/schema.h"
#include "ruedo/sim_time.h"

namespace ruedo::log {

// Bytes of malloc(), which grow without a second copy where the system moves pages instead.
class GrowingBytes {
 public:
  std::byte* grow(size_t size);  // so many more; returns where they begin. Throws std::bad_alloc
  void append(int64_t value);
  size_t size() const { return size_; }
  const std::byte* data() const { return bytes_.get(); }
  std::byte* release();  // no larger than its size, to be given to std::free(); null: empty

 private:
  struct Free {
    void operator()(std::byte* bytes) const;
  };
  std::unique_ptr<std::byte, Free> bytes_;
  size_t size_ = 0, room_ = 0;
};

struct Column {
  std::string name;  // the field's
  Primitive type = Primitive::none;
  std::vector<int64_t> shape;  // of a message's value; empty: one value. [0] is -1 where it differs
  GrowingBytes values;         // in the host's byte order; of texts their bytes, without ends
  GrowingBytes text_ends;      // int64: where each text ends
  GrowingBytes ends;           // int64, where shape[0] is -1: the values of each message end there
};

class Table {
 public:
  explicit Table(const Schema& schema);

  // Whether a type has columns: its fields are numbers, texts, and arrays of them in which no
  // dimension but the first varies.
  static bool fits(const Schema& schema);

  // False, without an effect, unless the bytes are one whole message of the type.
  bool add(std::span<const uint8_t> message);

  const Schema& schema() const { return *schema_; }
  int64_t messages() const { return messages_; }
  std::vector<Column>& columns() { return columns_; }

 private:
  void add_field(const Field& field, Column& column, std::span<const uint8_t>& rest);
  void note_count(const Field& field, Column& column, int64_t count) const;

  const Schema* schema_;
  std::vector<Column> columns_;
  std::vector<int64_t> counts_;  // what the integer fields of the message hold
  int64_t messages_ = 0;
};

struct ColumnRequest {
  std::function<bool(const std::string& channel)> wanted;  // none: all
  SimTime begin_us = std::numeric_limits<SimTime>::min();  // messages from then
  SimTime end_us = std::numeric_limits<SimTime>::max();    // up to then, itself included
  // Takes the messages whose type has no columns.
  std::function<void(const std::string& channel, std::span<const uint8_t> message)> other;
  std::function<void()> poll;  // called now and then; what it throws ends the reading
};

struct Columns {
  std::map<std::string, Table> tables;
  std::string fault;  // where the log is damaged or cut off; "": it is not
};

// Messages of types that Ruedo does not know, and of another type than the channel's first, are
// left out. Throws InputError if the file is not a log.
Columns read_columns(const std::string& path, const ColumnRequest& request);

}  // namespace ruedo::log
