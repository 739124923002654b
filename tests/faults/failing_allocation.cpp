// Preloaded into a program: an allocation of main, or of what comes after it, fails.
//   FLYBALL_FAIL_ALLOCATION=k  the k-th, from 1
//   FLYBALL_MEMORY_STAYS_SHORT  and all after it
//   FLYBALL_COUNT_ALLOCATIONS=file  how many there were
// Programs that it starts are left alone.
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>

#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

namespace {

using Main = int(int, char**, char**);

constinit std::atomic<long> count{0};
constinit long fails_at = 0;
constinit bool stays_short = false;
constinit bool counting = false;
constinit pid_t program = 0;
constinit Main* program_main = nullptr;

bool fails() noexcept {
  if (!counting) {
    return false;
  }
  const long k = ++count;
  // A child between fork and exec has nobody to tell.
  return (k == fails_at || (stays_short && fails_at > 0 && k > fails_at)) && ::getpid() == program;
}

int counted_main(int argc, char** argv, char** environment) {
  const char* k = std::getenv("FLYBALL_FAIL_ALLOCATION");
  const char* file = std::getenv("FLYBALL_COUNT_ALLOCATIONS");
  fails_at = k != nullptr ? std::atol(k) : 0;
  stays_short = std::getenv("FLYBALL_MEMORY_STAYS_SHORT") != nullptr;
  ::unsetenv("LD_PRELOAD");
  program = ::getpid();
  counting = true;
  const int status = program_main(argc, argv, environment);
  counting = false;
  if (file != nullptr) {
    const int counts = ::open(file, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    ::dprintf(counts, "%ld\n", count.load());
    ::close(counts);
  }
  return status;
}

}  // namespace

extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t items, std::size_t size);
void* __libc_realloc(void* pointer, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  return fails() ? (errno = ENOMEM, nullptr) : __libc_malloc(size);
}

void* calloc(std::size_t items, std::size_t size) {
  return fails() ? (errno = ENOMEM, nullptr) : __libc_calloc(items, size);
}

void* realloc(void* pointer, std::size_t size) {
  return fails() ? (errno = ENOMEM, nullptr) : __libc_realloc(pointer, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return fails() ? (errno = ENOMEM, nullptr) : __libc_memalign(alignment, size);
}

int posix_memalign(void** pointer, std::size_t alignment, std::size_t size) {
  *pointer = fails() ? nullptr : __libc_memalign(alignment, size);
  return *pointer == nullptr ? ENOMEM : 0;
}

int __libc_start_main(Main* start, int argc, char** argv, void (*init)(), void (*fini)(),
                      void (*end)(), void* stack) {
  program_main = start;
  using Start = int(Main*, int, char**, void (*)(), void (*)(), void (*)(), void*);
  return reinterpret_cast<Start*>(::dlsym(RTLD_NEXT, "__libc_start_main"))(counted_main, argc, argv,
                                                                           init, fini, end, stack);
}

}  // extern "C"
