// The messages of a log as NumPy arrays.
#pragma once

#include <nanobind/nanobind.h>

namespace nb = nanobind;

void add_log_columns(nb::module_& module);
