#pragma once

#include <cstddef>

namespace flyball::test {

/// Whether this build can make allocations fail; sanitizers bring their own allocator, which is
/// left alone.
[[nodiscard]] bool injects_faults() noexcept;

/// Memory that this thread holds now, in blocks.
[[nodiscard]] long blocks_held() noexcept;

/// While it lives, the k-th allocation of this thread fails, from 1, and all after it if memory
/// does not come back.
class AllocationFault {
 public:
  enum class Memory { comes_back, stays_short };
  AllocationFault(std::size_t k, Memory memory) noexcept;
  ~AllocationFault();
  AllocationFault(const AllocationFault&) = delete;
  AllocationFault& operator=(const AllocationFault&) = delete;

  /// Whether there were as many allocations.
  [[nodiscard]] bool struck() const noexcept;
};

}  // namespace flyball::test
