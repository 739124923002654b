#pragma once

// Kernels on raw arrays are compiled twice, for every processor and for those with 256-bit vectors
// and fused multiply-add, in the namespaces `baseline` and `wide`; which of them runs is asked for
// when running.

#if defined(__x86_64__) && !defined(__AVX2__)
#define FLYBALL_WIDE_VECTORS
#endif

namespace flyball::detail {

#ifdef FLYBALL_WIDE_VECTORS
[[nodiscard]] inline bool has_wide_vectors() {
  static const bool has = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  return has;
}
#endif

}  // namespace flyball::detail
