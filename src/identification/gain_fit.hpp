#pragma once

#include "identification/output_error.hpp"
#include "identification/robust_fit.hpp"
#include "identification/start.hpp"

/// The fit of the four gains and the sensors' delays from a regression's gains.
namespace flyball::identification {

[[nodiscard]] Bounds make_bounds(const OutputErrorProblem& problem, const StartGains& start,
                                 const FitOptions& options);

/// A thinned problem decides between several time constants; the whole one is then solved with
/// scales and angles refreshed.
/// @param scales  Set to those of the last refresh.
[[nodiscard]] RobustFit fit_gains(OutputErrorProblem& problem, const StartGains& gains,
                                  const Bounds& bounds, const FitOptions& options,
                                  ChannelScales& scales);

}  // namespace flyball::identification
