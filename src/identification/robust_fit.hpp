#pragma once

#include <array>
#include <limits>
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

struct RecordNoise;

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
/// bounds, until a step gains, or promised and did not keep, less than `tolerance` (in units of the
/// loss, that is of χ²); or until the cost would not get below `worthwhile` if all iterations that
/// are left gained as much as the last one. Source: Moré, "The Levenberg–Marquardt algorithm"
/// (1978); bounds by projection.
[[nodiscard]] RobustFit minimize(OutputErrorProblem& problem, const Eigen::VectorXd& start,
                                 const std::vector<bool>& free, const Bounds& bounds,
                                 const ChannelScales& scales, int max_iterations, double tolerance,
                                 double worthwhile = std::numeric_limits<double>::infinity());

/// Robust scales of the residuals at x, floored by what the columns' resolution allows.
[[nodiscard]] ChannelScales residual_scales(OutputErrorProblem& problem, const Eigen::VectorXd& x);

/// The loss of all residuals and priors at x.
[[nodiscard]] double cost_at(OutputErrorProblem& problem, const Eigen::VectorXd& x,
                             const ChannelScales& scales);

/// What some more parameters would gain together at a minimum over others: the step to their best
/// values and the fall of the cost, to first order. No gain for those that the data do not move.
struct Score {
  Eigen::VectorXd step{};
  double gain = 0.0;
};
[[nodiscard]] std::vector<Score> scores(OutputErrorProblem& problem, const Eigen::VectorXd& x,
                                        const std::vector<bool>& free, const Bounds& bounds,
                                        const ChannelScales& scales,
                                        const std::vector<std::vector<Eigen::Index>>& groups);

/// 1/s², of the square of the sum of the steps' ages in the cost: far above what else tells of it.
[[nodiscard]] double age_weight(const OutputErrorProblem& problem);

/// Covariances of all parameters at a minimum: HAC, block sandwich (where the record's noise is
/// known, by that instead), residual autocorrelation. Rows and columns of fixed parameters and of
/// those at a bound are zero.
struct Covariances {
  std::array<Eigen::MatrixXd, 3> estimates;
  Eigen::MatrixXd independent;  ///< What it would be if residuals were independent.
  bool singular = false;
  double few_blocks = 1.0;  ///< What the block sandwich is larger by for its few blocks.
  /// Of the model itself: steps, the largest of which counts as a standard error.
  std::vector<Eigen::VectorXd> doubts{};
  /// How much larger a parameter's variance is than independent residuals would make it, at
  /// least 1.
  [[nodiscard]] double inflation(Eigen::Index parameter) const;
  /// The same without what few blocks add, for sums of which a threshold allows for their spread.
  [[nodiscard]] double score_inflation(Eigen::Index parameter) const;
  /// Largest of the three standard errors of gradient · x, with the largest doubt.
  [[nodiscard]] double standard_error(const Eigen::VectorXd& gradient) const;
  /// A covariance of gradients · x that is no smaller than any of the three, with the doubts, in
  /// any direction. @param gradients  One a row.
  [[nodiscard]] Eigen::MatrixXd joint(const Eigen::MatrixXd& gradients) const;
};

/// @param noise  Of the record (record_noise.hpp). Without it the block sandwich is there, which
/// few blocks make large: for a term's evidence, not for an interval.
[[nodiscard]] Covariances covariances(OutputErrorProblem& problem, const Eigen::VectorXd& x,
                                      const std::vector<bool>& free, const Bounds& bounds,
                                      const ChannelScales& scales,
                                      const RecordNoise* noise = nullptr);

}  // namespace flyball::identification
