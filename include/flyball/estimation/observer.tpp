#pragma once

#include <flyball/core/signal.hpp>
#include <flyball/estimation/observer.hpp>

namespace flyball {

namespace detail {
struct ObserverDefinitions {};
}  // namespace detail

template <int States, int Inputs, int Outputs>
bool Observer<States, Inputs, Outputs>::take(const StateVector& x_hat) noexcept {
  const bool usable = is_signal(x_hat);
  if (usable) {
    x_hat_ = x_hat;
  }
  return usable;
}

template <int States, int Inputs, int Outputs>
bool Observer<States, Inputs, Outputs>::predict(const InputVector& u) noexcept {
  StateVector predicted = plant_.A * x_hat_;
  const bool used = is_signal(u);
  if (used) {
    predicted.noalias() += plant_.B * u;
  } else {
    InputVector known = u;
    detail::keep_signals(known);
    predicted.noalias() += plant_.B * known;
  }
  return take(predicted) && used;
}

template <int States, int Inputs, int Outputs>
bool Observer<States, Inputs, Outputs>::update(const OutputVector& y,
                                               const InputVector& u) noexcept {
  if (!is_signal(y)) {
    return false;
  }
  OutputVector innovation = y;
  innovation.noalias() -= plant_.C * x_hat_;
  if (feedthrough_) {
    innovation.noalias() -= plant_.D * u;
  }
  StateVector corrected = x_hat_;
  corrected.noalias() += K_ * innovation;
  return take(corrected);
}

template <int States, int Inputs, int Outputs>
bool LuenbergerObserver<States, Inputs, Outputs>::step(const InputVector& u,
                                                       const OutputVector& y) noexcept {
  InputVector known = u;
  detail::keep_signals(known);
  StateVector next = plant_.A * x_hat_;
  next.noalias() += plant_.B * known;
  const bool measured = is_signal(y);
  if (measured) {
    OutputVector innovation = y;
    innovation.noalias() -= plant_.C * x_hat_;
    innovation.noalias() -= plant_.D * known;
    next.noalias() += L_ * innovation;
  }
  return reset(next) && measured && is_signal(u);
}

template <int States, int Inputs, int Outputs>
bool LuenbergerObserver<States, Inputs, Outputs>::reset(const StateVector& x_hat) noexcept {
  const bool usable = is_signal(x_hat);
  if (usable) {
    x_hat_ = x_hat;
  }
  return usable;
}

}  // namespace flyball
