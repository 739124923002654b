#pragma once

// Kernels on raw arrays are compiled twice, for every processor and for those with 256-bit vectors
// and fused multiply-add, in the namespaces `baseline` and `wide`; which of them runs is asked for
// when running.

/// FLYBALL_KERNEL(void exponential(…)): a kernel's declaration, in both namespaces.
#define FLYBALL_KERNEL(...) \
  namespace baseline {      \
  __VA_ARGS__;              \
  }                         \
  namespace wide {          \
  __VA_ARGS__;              \
  }

/// FLYBALL_RUN_KERNEL(exponential, …): what the variant for this processor answers.
#if defined(__x86_64__) && !defined(__AVX2__)
#define FLYBALL_WIDE_VECTORS
#define FLYBALL_RUN_KERNEL(kernel, ...) \
  (has_wide_vectors() ? wide::kernel(__VA_ARGS__) : baseline::kernel(__VA_ARGS__))
#else
#define FLYBALL_RUN_KERNEL(kernel, ...) baseline::kernel(__VA_ARGS__)
#endif

namespace flyball::detail {

#ifdef FLYBALL_WIDE_VECTORS
[[nodiscard]] inline bool has_wide_vectors() {
  static const bool has = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  return has;
}
/// 512-bit vectors, too: of kernels whose time is all in products.
[[nodiscard]] inline bool has_widest_vectors() {
  static const bool has = has_wide_vectors() && __builtin_cpu_supports("avx512f") != 0 &&
                          __builtin_cpu_supports("avx512dq") != 0 &&
                          __builtin_cpu_supports("avx512vl") != 0;
  return has;
}
#endif

}  // namespace flyball::detail
