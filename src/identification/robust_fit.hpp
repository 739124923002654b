#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "identification/output_error.hpp"

/// Levenberg–Marquardt on the soft-L1 loss of the scaled residuals, and the variance of its answer.
namespace flyball::identification {

/// Scale of each channel's residuals (robust standard deviation); 0 switches a channel off.
struct ChannelScales {
  double difference = 1.0;
  double velocity = 1.0;
};

struct Bounds {
  Eigen::VectorXd lower;
  Eigen::VectorXd upper;
};

struct RobustFit {
  Eigen::VectorXd x;
  double cost = 0.0;
  int iterations = 0;
  bool converged = false;
};

/// Minimises Σ ρ(r/σ), ρ(z) = 2δ²(√(1 + (z/δ)²) − 1), δ = 1.5, over the free parameters in their
/// bounds, until a step gains less than `tolerance` (in units of the loss, that is of χ²). Source:
/// Moré, "The Levenberg–Marquardt algorithm" (1978); bounds by projection.
[[nodiscard]] RobustFit minimize(OutputErrorProblem& problem, const Eigen::VectorXd& start,
                                 const std::vector<bool>& free, const Bounds& bounds,
                                 const ChannelScales& scales, int max_iterations, double tolerance);

/// Robust scales of the residuals at x, floored by what the columns' resolution allows.
[[nodiscard]] ChannelScales residual_scales(OutputErrorProblem& problem, const Eigen::VectorXd& x);

/// Covariances of all parameters at a minimum: HAC, block sandwich, residual autocorrelation.
/// Rows and columns of fixed parameters and of those at a bound are zero.
struct Covariances {
  std::array<Eigen::MatrixXd, 3> estimates;
  Eigen::MatrixXd independent;  ///< What it would be if residuals were independent.
  bool singular = false;
  /// Largest of the three standard errors of gradient · x.
  [[nodiscard]] double standard_error(const Eigen::VectorXd& gradient) const;
};

[[nodiscard]] Covariances covariances(OutputErrorProblem& problem, const Eigen::VectorXd& x,
                                      const std::vector<bool>& free, const Bounds& bounds,
                                      const ChannelScales& scales);

}  // namespace flyball::identification
