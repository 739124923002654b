#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "faults/file_fault.hpp"

namespace flyball::test {

namespace {

struct State {
  std::size_t left = 0;
  FileFault::What what = FileFault::What::fails;
  int error = 0;
  bool struck = false;
};
constinit State state;

/// Whether this operation fails; errno is set.
bool fails() noexcept {
  if (state.left == 0 || --state.left > 0) {
    return false;
  }
  state.struck = true;
  if (state.what == FileFault::What::kills) {
    ::_exit(99);
  }
  errno = state.error;
  return true;
}

/// Of an operation that a full disk does not hinder.
void may_be_killed() noexcept {
  if (state.what == FileFault::What::kills) {
    (void)fails();
  }
}

/// The C library's function of a name.
template <class Function>
Function* next(const char* name) noexcept {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

FileFault::FileFault(std::size_t k, What what, int error) noexcept {
  state = {k, what, error, false};
}

FileFault::~FileFault() {
  state = {};
}

bool FileFault::struck() const noexcept {
  return state.struck;
}

}  // namespace flyball::test

// A definition in the executable comes before the library's, for the C++ library too.
extern "C" {

using flyball::test::fails;
using flyball::test::may_be_killed;
using flyball::test::next;

ssize_t write(int fd, const void* bytes, size_t size) {
  return fails() ? -1 : next<ssize_t(int, const void*, size_t)>("write")(fd, bytes, size);
}

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  if ((flags & O_ACCMODE) != O_RDONLY && fails()) {
    return -1;
  }
  return next<int(const char*, int, ...)>("open")(path, flags, mode);
}

int rename(const char* from, const char* to) {
  return fails() ? -1 : next<int(const char*, const char*)>("rename")(from, to);
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) {
  return fails() ? -1
                 : next<int(int, const char*, int, const char*, unsigned)>("renameat2")(
                       from_folder, from, to_folder, to, flags);
}

int mkdir(const char* path, mode_t mode) {
  return fails() ? -1 : next<int(const char*, mode_t)>("mkdir")(path, mode);
}

char* mkdtemp(char* pattern) {
  return fails() ? nullptr : next<char*(char*)>("mkdtemp")(pattern);
}

int fsync(int fd) {
  return fails() ? -1 : next<int(int)>("fsync")(fd);
}

int link(const char* from, const char* to) {
  may_be_killed();
  return next<int(const char*, const char*)>("link")(from, to);
}

int unlink(const char* path) {
  may_be_killed();
  return next<int(const char*)>("unlink")(path);
}

int unlinkat(int folder, const char* path, int flags) {
  may_be_killed();
  return next<int(int, const char*, int)>("unlinkat")(folder, path, flags);
}

int remove(const char* path) {
  may_be_killed();
  return next<int(const char*)>("remove")(path);
}

int rmdir(const char* path) {
  may_be_killed();
  return next<int(const char*)>("rmdir")(path);
}

int chmod(const char* path, mode_t mode) {
  may_be_killed();
  return next<int(const char*, mode_t)>("chmod")(path, mode);
}

int chown(const char* path, uid_t owner, gid_t group) {
  may_be_killed();
  return next<int(const char*, uid_t, gid_t)>("chown")(path, owner, group);
}

int fchmod(int fd, mode_t mode) {
  may_be_killed();
  return next<int(int, mode_t)>("fchmod")(fd, mode);
}

}  // extern "C"
