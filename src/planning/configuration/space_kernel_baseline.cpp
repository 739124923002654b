#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "planning/configuration/space_program.hpp"

#define FLYBALL_VARIANT baseline
#include "planning/configuration/box_kernel_body.hpp"
