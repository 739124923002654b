#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>
#include <vector>

#include "math/extended/extended_eigenvalues_kernel.hpp"

#define FLYBALL_VARIANT baseline
#include "math/extended/extended_eigenvalues_kernel_body.hpp"
