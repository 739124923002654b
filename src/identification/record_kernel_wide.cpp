#include <algorithm>
#include <cmath>
#include <limits>

#include "identification/record_kernel.hpp"
#include "math/dense/gemm_kernel.hpp"

// For processors with 256-bit vectors and fused multiply-add, which instruction_set.hpp asks for
// when running. Only functions of this variant's namespace are compiled for them.
#ifdef FLYBALL_WIDE_VECTORS
#define FLYBALL_VARIANT wide
#define FLYBALL_HOLD(lanes) __asm__("" : "+x"(lanes))
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,fma")
#endif
#include "identification/record_kernel_body.hpp"
#ifdef __clang__
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif
