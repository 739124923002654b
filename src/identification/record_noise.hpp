#pragma once

#include <vector>

#include <Eigen/Core>

#include "identification/robust_fit.hpp"

/// What the noise of a record makes of the estimate.
///
/// What a free run misses by has few causes: the recorded voltage differs from the one that was
/// applied by a noise that is new in each row; something pushes that lasts (friction that varies, a
/// battery); each position and each velocity has a noise of its own. The first two pass through the
/// mechanism, which remembers them for kA/kV, and a position's is in every difference that it ends.
/// Their sizes are found by maximum likelihood, which weighs all frequencies alike, so that the
/// parameters' share of the residuals does not matter; residuals' own covariances lack it where the
/// gains hang on it, at low frequencies. The noises are then carried through to the estimate
/// without a bandwidth to choose. What lasts is no known process and is left to those covariances.
namespace flyball::identification {

/// Standard deviations.
struct RecordNoise {
  double voltage = 1e-3;      ///< V √s: white, of what pushes.
  double disturbance = 1e-4;  ///< V, of what pushes and lasts.
  double memory = 0.5;        ///< s, of the disturbance: correlation e^(−t/memory).
  double position = 0.0;      ///< unit, of each fresh value.
  double velocity = 0.0;      ///< unit/s, of each fresh value.
};

/// Maximum likelihood of the residuals at x as a mechanism's that those disturb: a Kalman filter
/// over each run gives it, innovations beyond three standard deviations count linearly.
/// Cost: O(residuals), at most 500 of a run, some fifty times.
[[nodiscard]] RecordNoise estimate_record_noise(OutputErrorProblem& problem,
                                                const Eigen::VectorXd& x,
                                                const ChannelScales& scales);

/// Covariance of the scores Σ Jᵀψ(r/σ)/σ of all runs under that noise of voltage, position and
/// velocity, to first order.
/// @param x     The minimum. @param free  The parameters that it is asked for.
/// Source: Ljung, "System Identification", 2nd ed., section 9.5 (correlated residuals).
[[nodiscard]] Eigen::MatrixXd score_covariance(OutputErrorProblem& problem,
                                               const Eigen::VectorXd& x,
                                               const std::vector<bool>& free,
                                               const ChannelScales& scales,
                                               const RecordNoise& noise);

}  // namespace flyball::identification
