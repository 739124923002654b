#pragma once

#include <cmath>

#include <flyball/control/state_feedback.hpp>

namespace flyball {

namespace detail {
struct StateFeedbackDefinitions {};
}  // namespace detail

template <int States, int Inputs>
auto StateFeedback<States, Inputs>::clamp(const InputVector& u) const noexcept -> InputVector {
  InputVector limited = u;
  for (Eigen::Index i = 0; i < limited.size(); ++i) {
    limited(i) = detail::limited(u(i), u_min_(i), u_max_(i));
  }
  return limited;
}

template <int States, int Inputs>
auto StateFeedback<States, Inputs>::calculate(const StateVector& x, const StateVector& r,
                                              const InputVector& u_ff) const noexcept
    -> InputVector {
  StateVector error = r - x;
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    if (modulus_(i) > 0.0) {
      error(i) = std::remainder(error(i), modulus_(i));
    }
  }
  const InputVector u = K_ * error + u_ff;
  return clamp(u);
}

template <int States, int Inputs>
auto StateFeedback<States, Inputs>::calculate(const StateVector& x,
                                              const StateVector& r) const noexcept -> InputVector {
  return calculate(x, r, InputVector::Zero(K_.rows()));
}

}  // namespace flyball
