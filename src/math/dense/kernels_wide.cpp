#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "math/dense/gemm_kernel.hpp"
#include "math/dense/panel_kernel.hpp"
#include "math/dense/schur_kernel.hpp"
#include "math/equations/lyapunov_kernel.hpp"
#include "math/equations/sylvester_kernel.hpp"
#include "math/exponential/matrix_exponential_kernel.hpp"
#include "math/riccati/riccati_kernel.hpp"

// The same source for processors with 256-bit vectors and fused multiply-add, which
// instruction_set.hpp asks for when running. Only functions of this variant's namespace are
// compiled for them: everything else is declared above.
#ifdef FLYBALL_WIDE_VECTORS
#define FLYBALL_VARIANT wide
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,fma")
#endif
#include "math/dense/panel_kernel_body.hpp"
#include "math/dense/schur_kernel_body.hpp"
#include "math/dense/symmetric_kernel_body.hpp"
#include "math/equations/lyapunov_kernel_body.hpp"
#include "math/equations/sylvester_kernel_body.hpp"
#include "math/exponential/matrix_exponential_kernel_body.hpp"
#include "math/riccati/riccati_kernel_closing.hpp"
#ifdef __clang__
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif
