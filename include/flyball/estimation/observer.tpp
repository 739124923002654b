#pragma once

#include <flyball/estimation/observer.hpp>

namespace flyball {

template <int States, int Inputs, int Outputs>
void Observer<States, Inputs, Outputs>::predict(const InputVector& u) noexcept {
  const StateVector predicted = plant_.A * x_hat_ + plant_.B * u;
  x_hat_ = predicted;
}

template <int States, int Inputs, int Outputs>
bool Observer<States, Inputs, Outputs>::update(const OutputVector& y,
                                               const InputVector& u) noexcept {
  if (!y.allFinite()) {
    return false;
  }
  const OutputVector innovation = y - plant_.C * x_hat_ - plant_.D * u;
  x_hat_ += K_ * innovation;
  return true;
}

}  // namespace flyball
