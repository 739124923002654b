#include "optimization/mpc/stage_qp.hpp"

#define FLYBALL_VARIANT baseline
#include "optimization/mpc/stage_qp_kernel_body.hpp"
