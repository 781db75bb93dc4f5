// Counts the allocations of this test program.
#pragma once

#include <cstdint>

namespace ruedo::server {

uint64_t allocations();    // calls of operator new so far, in all threads

}  // namespace ruedo::server
