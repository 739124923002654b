#pragma once

#include <cstddef>

namespace flyball::test {

/// Whether this build counts allocations; sanitizers bring their own allocator, which is left
/// alone.
[[nodiscard]] bool counts_allocations() noexcept;

/// Calls of malloc and its kin (operator new and Eigen end there) in this thread so far.
[[nodiscard]] std::size_t allocation_count() noexcept;

/// Allocations since it was made.
class AllocationCounter {
 public:
  [[nodiscard]] std::size_t count() const noexcept { return allocation_count() - start_; }

 private:
  std::size_t start_ = allocation_count();
};

}  // namespace flyball::test
