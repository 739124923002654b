#include "math/dense/gemm_kernel.hpp"

// One source for three instruction sets: only functions of a variant's namespace are compiled for
// wider ones.

#define FLYBALL_VARIANT baseline
#define FLYBALL_GEMM_WIDTH 4
#include "math/dense/gemm_kernel_body.inc"
#undef FLYBALL_VARIANT
#undef FLYBALL_GEMM_WIDTH

#ifdef FLYBALL_WIDE_VECTORS
#define FLYBALL_VARIANT wide
#define FLYBALL_GEMM_WIDTH 4
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,fma")
#endif
#include "math/dense/gemm_kernel_body.inc"
#undef FLYBALL_VARIANT
#undef FLYBALL_GEMM_WIDTH
#ifdef __clang__
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

#define FLYBALL_VARIANT widest
#define FLYBALL_GEMM_WIDTH 8
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512vl,avx2,fma"))), \
                             apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx512f,avx512dq,avx512vl,avx2,fma")
#endif
#include "math/dense/gemm_kernel_body.inc"
#ifdef __clang__
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif

namespace flyball::detail {

void gemm(const GemmTask& task) {
#ifdef FLYBALL_WIDE_VECTORS
  (has_widest_vectors() ? widest::gemm_panels
                        : (has_wide_vectors() ? wide::gemm_panels : baseline::gemm_panels))(task);
#else
  baseline::gemm_panels(task);
#endif
}

}  // namespace flyball::detail
