#pragma once

#include <cerrno>
#include <cstddef>

namespace flyball::test {

/// While it lives, the k-th operation of this process that adds to a file system (open for writing,
/// write, rename, folder made) fails, from 1; or the process ends there, as a kill does, or where
/// something is removed, linked or its mode changed.
class FileFault {
 public:
  enum class What { fails, kills };
  /// @param error  An errno, such as EIO.
  FileFault(std::size_t k, What what, int error = ENOSPC) noexcept;
  ~FileFault();
  FileFault(const FileFault&) = delete;
  FileFault& operator=(const FileFault&) = delete;

  [[nodiscard]] bool struck() const noexcept;
};

}  // namespace flyball::test
