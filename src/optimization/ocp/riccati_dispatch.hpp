#pragma once

#include "optimization/ocp/riccati_kernel.hpp"

namespace flyball::optimization::detail {

/// The variants of the recursion that suit this processor.
struct RiccatiKernels {
  bool (*factor)(const StageSystem&) noexcept;
  void (*solve)(const StageSystem&, const StageVectors&) noexcept;
};

[[nodiscard]] const RiccatiKernels& riccati_kernels();

}  // namespace flyball::optimization::detail
