#include <cerrno>

#include "faults/allocation_fault.hpp"
#include "support/sanitizer.hpp"

#if defined(__GLIBC__) && !FLYBALL_SANITIZED
#define FLYBALL_INJECTS_FAULTS 1
#endif

namespace flyball::test {

namespace {

struct State {
  std::size_t left = 0;  ///< Allocations before the one that fails; 0: none fails.
  bool stays_short = false;
  bool struck = false;
  long held = 0;
};
thread_local constinit State state;

/// Whether this allocation fails.
[[maybe_unused]] bool fails() noexcept {
  if (state.struck) {
    return state.stays_short;
  }
  if (state.left == 0 || --state.left > 0) {
    return false;
  }
  state.struck = true;
  return true;
}

[[maybe_unused]] void* counted(void* block) noexcept {
  state.held += block != nullptr ? 1 : 0;
  return block;
}

}  // namespace

bool injects_faults() noexcept {
#ifdef FLYBALL_INJECTS_FAULTS
  return true;
#else
  return false;
#endif
}

long blocks_held() noexcept {
  return state.held;
}

AllocationFault::AllocationFault(std::size_t k, Memory memory) noexcept {
  state.struck = false;
  state.stays_short = memory == Memory::stays_short;
  state.left = k;
}

AllocationFault::~AllocationFault() {
  state.left = 0;
  state.struck = false;
}

bool AllocationFault::struck() const noexcept {
  return state.struck;
}

}  // namespace flyball::test

#ifdef FLYBALL_INJECTS_FAULTS
// glibc's own names for its allocator; a definition in the executable comes before the library's.
extern "C" {

using flyball::test::counted;
using flyball::test::fails;

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* pointer, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* pointer);

void* malloc(std::size_t size) {
  return fails() ? nullptr : counted(__libc_malloc(size));
}

void* calloc(std::size_t count, std::size_t size) {
  return fails() ? nullptr : counted(__libc_calloc(count, size));
}

void* realloc(void* pointer, std::size_t size) {
  if (fails()) {
    return nullptr;
  }
  void* const moved = __libc_realloc(pointer, size);
  return pointer == nullptr ? counted(moved) : moved;
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return fails() ? nullptr : counted(__libc_memalign(alignment, size));
}

int posix_memalign(void** pointer, std::size_t alignment, std::size_t size) {
  *pointer = fails() ? nullptr : counted(__libc_memalign(alignment, size));
  return *pointer == nullptr ? ENOMEM : 0;
}

void free(void* pointer) {
  flyball::test::state.held -= pointer != nullptr ? 1 : 0;
  __libc_free(pointer);
}

}  // extern "C"
#endif
