// Once the program ends, Python (before 3.14) ends each daemon thread that comes back for the
// interpreter's lock: it unwinds it, which frames that let no exception out, or take each for an
// error, do not survive. Such a thread waits for the end where it is.
#pragma once

#include <unistd.h>

#include <cxxabi.h>

[[noreturn]] inline void await_program_end() {
  for (;;) pause();
}

// Calls what runs Python, which may let other threads run meanwhile.
template <class Function>
void call_python(const Function& function) {
  try {
    function();
  } catch (abi::__forced_unwind&) {
    await_program_end();
  }
}
