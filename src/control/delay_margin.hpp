#pragma once

#include <complex>
#include <vector>

#include "control/sampled_loop.hpp"

namespace flyball::detail {

/// ln |L|: zero at a gain crossover.
[[nodiscard]] inline double log_gain(const std::complex<double>& L) {
  return std::log(std::abs(L));
}

/// The lag in (0, 2π] that turns L into -1 when |L| = 1.
[[nodiscard]] double lag_to_minus_one(const std::complex<double>& L);

/// The smallest further delay, s, at which the closed loop has a pole on the unit circle; ∞ if none
/// has. @param crossovers  rad a sample, where |L| = 1. @param sampled  The loop, which is stable.
[[nodiscard]] double delay_margin(const PlantInputLoop& loop, const std::vector<double>& crossovers,
                                  const SampledLoop& sampled);

}  // namespace flyball::detail
