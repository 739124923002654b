#include <cerrno>

#include "support/allocation_count.hpp"
#include "support/sanitizer.hpp"

#if defined(__GLIBC__) && !FLYBALL_SANITIZED
#define FLYBALL_COUNTS_ALLOCATIONS 1
#endif

namespace flyball::test {

namespace {
thread_local std::size_t allocations = 0;
}  // namespace

bool counts_allocations() noexcept {
#ifdef FLYBALL_COUNTS_ALLOCATIONS
  return true;
#else
  return false;
#endif
}

std::size_t allocation_count() noexcept {
  return allocations;
}

}  // namespace flyball::test

#ifdef FLYBALL_COUNTS_ALLOCATIONS
// glibc's own names for its allocator; a definition in the executable comes before the library's.
extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* pointer, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++flyball::test::allocations;
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) {
  ++flyball::test::allocations;
  return __libc_calloc(count, size);
}

void* realloc(void* pointer, std::size_t size) {
  ++flyball::test::allocations;
  return __libc_realloc(pointer, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++flyball::test::allocations;
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** pointer, std::size_t alignment, std::size_t size) {
  ++flyball::test::allocations;
  *pointer = __libc_memalign(alignment, size);
  return *pointer == nullptr ? ENOMEM : 0;
}

}  // extern "C"
#endif
