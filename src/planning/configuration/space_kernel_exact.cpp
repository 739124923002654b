#include "planning/configuration/space_program.hpp"

#define FLYBALL_VARIANT one
#define FLYBALL_ONE_LANE
#include "planning/configuration/space_kernel_body.hpp"

namespace flyball::detail {

double reach_of(const SpaceView<double>& space, const double* q,
                const InverseRates<double>& rates) noexcept {
  return one::reach(space, q, rates, false);
}

}  // namespace flyball::detail
