// operator new of this program, in a file of its own so that it is not inlined.
#include "counting_new.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<uint64_t> g_count{0};
}  // namespace

void* operator new(size_t size) {
  ++g_count;
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

}  // namespace ruedo::run
