#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/identification/feedforward_fit.hpp>

#include "identification/robust_fit.hpp"

/// Second looks at a finished fit.
namespace flyball::identification {

/// The largest kA that the data do not contradict (one-sided 95 %): the loss is profiled over
/// kA/kV with everything else refitted, and its rise compared with χ² inflated by the residuals'
/// correlation. Source: Venzon and Moolgavkar, Applied Statistics 37 (1988).
[[nodiscard]] double inertia_ceiling(OutputErrorProblem& problem, const RobustFit& best,
                                     const Bounds& bounds, const ChannelScales& scales,
                                     const Covariances& spread);

/// The largest kS that the data do not contradict where the fit ends at kS = 0: the loss profiled
/// over kS, its rise compared with χ² inflated by the residuals' correlation, or by what the fit
/// would gain from a friction below zero where that is more (as the model is wrong by it at least).
/// @param spread  With kS not held by its bound.
[[nodiscard]] double friction_ceiling(OutputErrorProblem& problem, const RobustFit& best,
                                      const Bounds& bounds, const ChannelScales& scales,
                                      const Covariances& spread);

/// Fits position differences alone and velocities alone and tells where their kA disagree.
void compare_channels(OutputErrorProblem& problem, const RobustFit& best, const Bounds& bounds,
                      const ChannelScales& scales, std::vector<Diagnostic>& diagnostics);

/// Tells where runs of one kind call for different gains.
void compare_repeats(const FeedforwardFit& fit, std::vector<Diagnostic>& diagnostics);

/// Tells where the speed overshoots after a step and the simulated one does not.
void detect_elasticity(const PreparedRecording& prepared, const FeedforwardFit& fit,
                       std::vector<Diagnostic>& diagnostics);

}  // namespace flyball::identification
