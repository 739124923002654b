#include "optimization/solver/bound_kernel.hpp"

#define FLYBALL_VARIANT baseline
#include "optimization/solver/bound_kernel_body.hpp"
