#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "math/riccati_kernel.hpp"

#define FLYBALL_VARIANT baseline
#include "math/riccati_kernel_body.hpp"
