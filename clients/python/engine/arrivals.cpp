// Objects are passed through as they are; references are counted by nanobind's handles.
#include "arrivals.h"

#include <cstdint>
#include <cstring>
#include <stdexcept>

#include <zlib.h>

#include "program_end.h"

namespace nb = nanobind;

namespace {

constexpr size_t kLongestChannel = 63, kLargestMessage = size_t{1} << 26;  // as arrivals.py
constexpr size_t kMostNames = 65536;
constexpr size_t kManifestEntry = 20;  // channel, sequence, size, crc

uint32_t number(const char* b) {
  const auto* bytes = reinterpret_cast<const uint8_t*>(b);
  return uint32_t{bytes[0]} << 24 | uint32_t{bytes[1]} << 16 | uint32_t{bytes[2]} << 8 | bytes[3];
}

// A channel's name as the string that is there already: bytes to str.
nb::object name_of(const nb::dict& names, const char* text, size_t size) {
  const nb::bytes key(text, size);
  if (PyObject* known = PyDict_GetItemWithError(names.ptr(), key.ptr())) return nb::borrow(known);
  nb::object name = nb::steal(PyUnicode_DecodeUTF8(text, static_cast<Py_ssize_t>(size), "replace"));
  if (!name) throw nb::python_error();
  if (nb::len(names) < kMostNames) names[key] = name;
  return name;
}

// The whole messages of a stream of frames from a place on, and where the rest begins; None for
// what no server of Ruedo's sends.
nb::object take_apart(const nb::bytes& data, size_t at, const nb::dict& names) {
  const char* const bytes = data.c_str();
  const size_t end = data.size();
  nb::list arrived;
  while (at <= end && end - at >= 12) {
    const size_t name_size = number(bytes + at + 4);
    if (name_size > kLongestChannel) return nb::none();
    if (end - at < 12 + name_size) break;
    const size_t size = number(bytes + at + 8 + name_size);
    if (size > kLargestMessage) return nb::none();
    if (end - at < 12 + name_size + size) break;
    const nb::object name = name_of(names, bytes + at + 8, name_size);
    const nb::bytes message(bytes + at + 12 + name_size, size);
    const nb::object one = nb::steal(PyTuple_Pack(2, name.ptr(), message.ptr()));
    if (!one) throw nb::python_error();
    arrived.append(one);
    at += 12 + name_size + size;
  }
  return nb::make_tuple(arrived, at);
}

// Each to its channel's collector, and what has handlers to hand_over(handlers, message).
void dispatch(const nb::list& arrived, const nb::dict& collectors, const nb::dict& handlers,
              const nb::callable& hand_over) {
  for (Py_ssize_t i = 0; i < PyList_Size(arrived.ptr()); ++i) {
    const nb::object one = nb::borrow(PyList_GetItem(arrived.ptr(), i));
    PyObject* const channel = PyTuple_GetItem(one.ptr(), 0);  // what both dictionaries have
    if (channel == nullptr) throw nb::python_error();
    if (PyObject* found = PyDict_GetItemWithError(collectors.ptr(), channel)) {
      const nb::object collector = nb::borrow(found);
      call_python([&] { collector(one); });
    }
    if (PyObject* found = PyDict_GetItemWithError(handlers.ptr(), channel)) {
      const nb::object listening = nb::borrow(found);
      call_python([&] { hand_over(listening, nb::handle(PyTuple_GetItem(one.ptr(), 1))); });
    }
  }
}

// Whether the messages that came, pairs of channel and bytes, are what a manifest lists, in its
// order. indices: of channels.
bool are_listed(const nb::object& fresh, const nb::bytes& tick, size_t at,
                const nb::dict& indices) {
  const char* entry = tick.c_str() + at;
  if (at > tick.size() || (tick.size() - at) % kManifestEntry != 0 ||
      (tick.size() - at) / kManifestEntry != nb::len(fresh))
    return false;
  const nb::object walk = nb::steal(PyObject_GetIter(fresh.ptr()));
  if (!walk) throw nb::python_error();
  for (; nb::object one = nb::steal(PyIter_Next(walk.ptr())); entry += kManifestEntry) {
    PyObject* const index = PyDict_GetItemWithError(indices.ptr(), PyTuple_GetItem(one.ptr(), 0));
    char* bytes = nullptr;
    Py_ssize_t size = 0;
    if (PyBytes_AsStringAndSize(PyTuple_GetItem(one.ptr(), 1), &bytes, &size) != 0)
      throw nb::python_error();
    if (index == nullptr || static_cast<uint32_t>(PyLong_AsLong(index)) != number(entry) ||
        static_cast<uint32_t>(size) != number(entry + 12))
      return false;
    const auto crc =
        ::crc32_z(0, reinterpret_cast<const uint8_t*>(bytes), static_cast<size_t>(size));
    if (static_cast<uint32_t>(crc) != number(entry + 16)) return false;
  }
  if (PyErr_Occurred() != nullptr) throw nb::python_error();
  return true;
}

// The messages of each channel, in order.
nb::dict by_channel(const nb::list& steps) {
  nb::dict sorted;
  for (const nb::handle step : steps) {
    for (const nb::handle one : nb::borrow<nb::list>(step[1])) {
      PyObject* const channel = PyTuple_GetItem(one.ptr(), 0);
      if (channel == nullptr) throw nb::python_error();
      PyObject* found = PyDict_GetItemWithError(sorted.ptr(), channel);
      nb::object list = found ? nb::borrow(found) : nb::object(nb::list());
      if (found == nullptr && PyDict_SetItem(sorted.ptr(), channel, list.ptr()) != 0)
        throw nb::python_error();
      if (PyList_Append(list.ptr(), PyTuple_GetItem(one.ptr(), 1)) != 0) throw nb::python_error();
    }
  }
  return sorted;
}

}  // namespace

void add_arrivals(nb::module_& module) {
  module.def("take_apart", &take_apart);
  module.def("dispatch", &dispatch);
  module.def("are_listed", &are_listed);
  module.def("by_channel", &by_channel);
}
