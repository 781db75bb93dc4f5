// The Python client's work for every single message of a run in lockstep, in C++: hundreds arrive
// with each step. bus.py, stream_transport.py and lockstep.py have the same in Python, for
// installations without the engine; tests hold the one against the other.
#pragma once

#include <nanobind/nanobind.h>

void add_arrivals(nanobind::module_& module);
