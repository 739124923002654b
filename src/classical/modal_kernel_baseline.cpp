#include <cstddef>

#include "classical/modal_kernel.hpp"

#define FLYBALL_VARIANT baseline
#include "classical/modal_kernel_body.hpp"
