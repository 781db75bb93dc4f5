// Counts the allocations of this test program.
#pragma once

#include <cstdint>

namespace ruedo::run {

uint64_t allocations();  // calls of operator new so far, in all threads

}  // namespace ruedo::run
