#include <cmath>

#include "math/expression/lane_kernel.hpp"

#define FLYBALL_VARIANT baseline
#include "math/expression/lane_kernel_body.hpp"

namespace flyball::expression::detail {

void run_scalar(Operation operation, const double* a, const double* b, const double* c,
                double* to) noexcept {
  // The commonest first: a loop whose operation is known needs no switch in it.
  switch (operation) {
    case Operation::exp:
      for (std::size_t l = 0; l < LaneTape::lanes; ++l) {
        to[l] = std::exp(a[l]);
      }
      return;
    case Operation::sqrt:
      for (std::size_t l = 0; l < LaneTape::lanes; ++l) {
        to[l] = std::sqrt(a[l]);
      }
      return;
    default:
      for (std::size_t l = 0; l < LaneTape::lanes; ++l) {
        to[l] = apply<double>(operation, a[l], b[l], c[l]);
      }
  }
}

}  // namespace flyball::expression::detail
