// Counts the allocations of this test program.
#pragma once

#include <cstdint>

namespace ruedo::run {

uint64_t allocations();  // calls of operator new, in all threads

// While one lives, the call of operator new with that number from here on, in any thread, throws.
class FailingAllocation {
 public:
  explicit FailingAllocation(uint64_t number);
  ~FailingAllocation();
  FailingAllocation(const FailingAllocation&) = delete;
  FailingAllocation& operator=(const FailingAllocation&) = delete;
  static bool has_failed();
};

}  // namespace ruedo::run
