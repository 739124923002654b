#pragma once

#include <flyball/control/feedforward.hpp>

namespace flyball {

namespace detail {
struct LinearPlantInversionDefinitions {};
}  // namespace detail

template <int States, int Inputs>
auto LinearPlantInversion<States, Inputs>::calculate(const StateVector& r,
                                                     const StateVector& r_next) const noexcept
    -> InputVector {
  const StateVector demand = r_next - A_ * r;
  InputVector u = B_pinv_ * demand;
  detail::keep_signals(u);
  return u;
}

}  // namespace flyball
