#include "optimization/ocp/riccati_dispatch.hpp"

namespace flyball::optimization::detail {

namespace {

RiccatiKernels choose() {
#ifdef FLYBALL_WIDE_VECTORS
  if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
      __builtin_cpu_supports("avx512vl") != 0) {
    return {widest::factor_stages, widest::solve_stages};
  }
  if (flyball::detail::has_wide_vectors()) {
    return {wide::factor_stages, wide::solve_stages};
  }
#endif
  return {baseline::factor_stages, baseline::solve_stages};
}

}  // namespace

const RiccatiKernels& riccati_kernels() {
  static const RiccatiKernels chosen = choose();
  return chosen;
}

}  // namespace flyball::optimization::detail
