// The messages of a log as NumPy arrays, for ruedo/logs.py.
#include "log_columns.h"

#include <cstdlib>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/unordered_set.h>
#include <nanobind/stl/vector.h>

#include "base/wire_size.h"
#include "log/columns.h"
#include "log/summary.h"
#include "python_thread.h"

namespace {

using ruedo::Primitive;
using ruedo::log::Column;
using ruedo::log::GrowingBytes;

// The array has the memory from now on.
nb::object array_of(GrowingBytes& bytes, Primitive type, std::vector<size_t> shape) {
  std::byte* memory = bytes.release();
  const nb::capsule owner(memory ? static_cast<void*>(memory) : std::malloc(1),
                          [](void* pointer) noexcept { std::free(pointer); });
  return nb::cast(nb::ndarray<nb::numpy>(owner.data(), shape.size(), shape.data(), owner, nullptr,
                                         dtype_of(type)));
}

nb::object whole_numbers(GrowingBytes& bytes) {
  return array_of(bytes, Primitive::int64, {bytes.size() / sizeof(int64_t)});
}

// Name, shape of each message's value, values, ends of texts, ends of messages; None without
// one of these.
nb::tuple parts_of(Column& column, int64_t messages) {
  const bool is_text = column.type == Primitive::string;
  std::vector<size_t> shape;
  if (is_text || (!column.shape.empty() && column.shape[0] < 0)) {
    const size_t size = is_text ? 1 : ruedo::wire_size(column.type);
    shape = {column.values.size() / size};
  } else {
    shape = {static_cast<size_t>(messages)};
    for (const int64_t count : column.shape) shape.push_back(static_cast<size_t>(count));
  }
  const bool differs = !column.shape.empty() && column.shape[0] < 0;
  nb::object values = array_of(column.values, is_text ? Primitive::byte : column.type, shape);
  return nb::make_tuple(column.name, nb::tuple(nb::cast(column.shape)), std::move(values),
                        is_text ? whole_numbers(column.text_ends) : nb::none(),
                        differs ? whole_numbers(column.ends) : nb::none());
}

// Channels: type, number of messages, and the parts of each field; and where the log is damaged.
nb::tuple read_columns(const nb::bytes& path,
                       const std::optional<std::unordered_set<std::string>>& channels,
                       std::optional<int64_t> begin_us, std::optional<int64_t> end_us,
                       const nb::callable& other) {
  ruedo::log::ColumnRequest request;
  if (channels)
    request.wanted = [&](const std::string& channel) { return channels->contains(channel); };
  if (begin_us) request.begin_us = *begin_us;
  if (end_us) request.end_us = *end_us;
  request.other = [&](const std::string& channel, std::span<const uint8_t> message) {
    call_python([&] {
      const nb::gil_scoped_acquire locked;
      other(nb::bytes(channel.data(), channel.size()), nb::bytes(message.data(), message.size()));
    });
  };
  request.poll = [] {
    call_python([] {
      const nb::gil_scoped_acquire locked;
      if (PyErr_CheckSignals() != 0) throw nb::python_error();
    });
  };
  const std::string file(path.c_str(), path.size());
  ruedo::log::Columns columns;
  {
    const Unlocked unlocked;
    columns = ruedo::log::read_columns(file, request);
  }
  nb::dict found;
  for (auto& [channel, table] : columns.tables) {
    nb::list fields;
    for (Column& column : table.columns()) fields.append(parts_of(column, table.messages()));
    found[nb::bytes(channel.data(), channel.size())] =
        nb::make_tuple(table.schema().name, table.messages(), fields);
  }
  return nb::make_tuple(found, columns.fault);
}

// Channels: type, number of messages, times of the first and the last; and where it is damaged.
nb::tuple summarize_log(const nb::bytes& path) {
  const std::string file(path.c_str(), path.size());
  ruedo::log::Summary summary;
  {
    const Unlocked unlocked;
    summary = ruedo::log::summarize(file);
  }
  nb::dict found;
  for (const ruedo::log::ChannelSummary& channel : summary.channels) {
    found[nb::bytes(channel.name.data(), channel.name.size())] =
        nb::make_tuple(channel.type, channel.messages, channel.first_us, channel.last_us);
  }
  return nb::make_tuple(found, summary.fault);
}

}  // namespace

void add_log_columns(nb::module_& module) {
  module.def("read_columns", &read_columns, nb::arg("path"), nb::arg("channels").none(),
             nb::arg("begin_us").none(), nb::arg("end_us").none(), nb::arg("other"));
  module.def("summarize_log", &summarize_log);
}
