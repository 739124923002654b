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

#define FLYBALL_VARIANT baseline
#include "math/dense/panel_kernel_body.hpp"
#include "math/dense/schur_kernel_body.hpp"
#include "math/dense/symmetric_kernel_body.hpp"
#include "math/equations/lyapunov_kernel_body.hpp"
#include "math/equations/sylvester_kernel_body.hpp"
#include "math/exponential/matrix_exponential_kernel_body.hpp"
#include "math/riccati/riccati_kernel_closing.hpp"
