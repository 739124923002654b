#include "optimization/solver/bound_kernel.hpp"

// For processors with 256-bit vectors and fused multiply-add, which FLYBALL_RUN_KERNEL asks for
// when running. Only functions of this variant's namespace are compiled for them.
#ifdef FLYBALL_WIDE_VECTORS
#define FLYBALL_VARIANT wide
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,fma")
#endif
#include "optimization/solver/bound_kernel_body.hpp"
#ifdef __clang__
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif
