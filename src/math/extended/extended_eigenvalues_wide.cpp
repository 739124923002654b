#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>
#include <vector>

#include "math/extended/extended_eigenvalues_kernel.hpp"

// Only functions of this variant's namespace are compiled for such processors.
#ifdef FLYBALL_WIDE_VECTORS
#define FLYBALL_VARIANT wide
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,fma")
#endif
#include "math/extended/extended_eigenvalues_kernel_body.hpp"
#ifdef __clang__
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif
