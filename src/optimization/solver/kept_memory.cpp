#include <cstddef>
#include <cstdlib>

#include "optimization/solver/kept_memory.hpp"

namespace flyball::optimization::detail {

void keep_freed_memory() noexcept {
  static const bool once = [] {
    constexpr std::size_t block = std::size_t{4} << 20U;
    void* volatile mapped = std::malloc(block);  // volatile: not left out
    std::free(mapped);
    return true;
  }();
  static_cast<void>(once);
}

}  // namespace flyball::optimization::detail
