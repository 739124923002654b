#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "math/lyapunov_kernel.hpp"
#include "math/matrix_exponential_kernel.hpp"
#include "math/riccati_kernel.hpp"
#include "math/sylvester_kernel.hpp"

#define FLYBALL_VARIANT baseline
#include "math/lyapunov_kernel_body.hpp"
#include "math/matrix_exponential_kernel_body.hpp"
#include "math/riccati_kernel_body.hpp"
#include "math/sylvester_kernel_body.hpp"
