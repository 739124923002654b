#pragma once

#include <cmath>
#include <complex>

#include <flyball/classical/transfer_function.hpp>

namespace flyball::detail {

/// What a PID controller is made of at a frequency: C = kp + ki I + kd D.
struct PidBasis {
  std::complex<double> integral;
  std::complex<double> derivative;
};

/// 1/s and s/(τ s + 1), or T z/(z - 1) and (z - 1)/((τ + T) z - τ). @param frequency  rad/s, > 0.
[[nodiscard]] inline PidBasis pid_basis(const std::optional<Time>& period, double tau,
                                        double frequency) {
  if (!period) {
    const std::complex<double> s(0.0, frequency);
    return {1.0 / s, s / (tau * s + 1.0)};
  }
  const double T = period->si();
  const std::complex<double> z = std::polar(1.0, frequency * T);
  // z - 1 without cancellation.
  const double half = 0.5 * frequency * T;
  const std::complex<double> step =
      std::complex<double>(0.0, 2.0 * std::sin(half)) * std::polar(1.0, half);
  return {T * z / step, step / (tau * step + T * z)};
}

}  // namespace flyball::detail
