// Shared by the module's parts: Python's lock, its signals, and NumPy's types.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include "program_end.h"
#include "ruedo/schema.h"

namespace nb = nanobind;

inline nb::dlpack::dtype dtype_of(ruedo::Primitive type) {
  switch (type) {
    case ruedo::Primitive::boolean: return nb::dtype<bool>();
    case ruedo::Primitive::byte: return nb::dtype<uint8_t>();
    case ruedo::Primitive::int8: return nb::dtype<int8_t>();
    case ruedo::Primitive::int16: return nb::dtype<int16_t>();
    case ruedo::Primitive::int32: return nb::dtype<int32_t>();
    case ruedo::Primitive::int64: return nb::dtype<int64_t>();
    case ruedo::Primitive::float32: return nb::dtype<float>();
    default: return nb::dtype<double>();
  }
}

// Lets other Python threads run for as long as it lives.
class Unlocked {
 public:
  Unlocked() : state_(PyEval_SaveThread()) {}
  ~Unlocked() {
    call_python([this] { PyEval_RestoreThread(state_); });
  }
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

 private:
  PyThreadState* const state_;
};

// Whether a signal has come, and its handler raised an exception. Called without Python's lock.
inline bool interrupts() {
  bool raised = false;
  call_python([&raised] {
    const nb::gil_scoped_acquire locked;
    raised = PyErr_CheckSignals() != 0;
  });
  return raised;
}
