#pragma once

#include <cstddef>

namespace flyball::test {

/// While it lives, the k-th operation of this process that changes a file system (open for writing,
/// write, close of what was written, rename, folder made, mode changed) fails with ENOSPC, from 1;
/// or the process ends there, as a kill does.
class FileFault {
 public:
  enum class What { fails, kills };
  FileFault(std::size_t k, What what) noexcept;
  ~FileFault();
  FileFault(const FileFault&) = delete;
  FileFault& operator=(const FileFault&) = delete;

  [[nodiscard]] bool struck() const noexcept;
};

}  // namespace flyball::test
