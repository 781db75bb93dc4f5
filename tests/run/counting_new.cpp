// operator new of this program, in a file of its own so that it is not inlined.
#include "counting_new.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<uint64_t> g_count{0}, g_fails{0};  // g_fails: 0: none
}  // namespace

void* operator new(size_t size) {
  if (++g_count == g_fails) throw std::bad_alloc();
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(size_t size,
                   const std::nothrow_t&) noexcept {  // not the sanitizer's: ours frees it
  ++g_count;
  return std::malloc(size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, size_t) noexcept { std::free(memory); }

namespace ruedo::run {

uint64_t allocations() { return g_count; }

FailingAllocation::FailingAllocation(uint64_t number) { g_fails = g_count + number; }
FailingAllocation::~FailingAllocation() { g_fails = 0; }
bool FailingAllocation::has_failed() { return g_count >= g_fails; }

}  // namespace ruedo::run
