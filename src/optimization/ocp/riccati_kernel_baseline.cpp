#include "optimization/ocp/riccati_kernel.hpp"

#define FLYBALL_VARIANT baseline
#include "optimization/ocp/riccati_kernel_body.hpp"
