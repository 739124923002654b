#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/optimization/robust_loss.hpp>

/// Least squares with bounds, robust losses and priors: what fits, smoothers and optimal control
/// share.
namespace flyball::optimization {

/// Why there is no fit.
enum class LeastSquaresError {
  no_start,      ///< The residuals or their Jacobian are not finite at the start.
  no_residuals,  ///< Nothing to fit: no residual and no prior.
};
[[nodiscard]] ErrorInfo error_info(LeastSquaresError code);

/// Residuals that belong together, such as those of one run, and the parameters that they depend
/// on; derive from it. Parameters that stand in one block only (a run's initial state) are
/// eliminated with it, so that the cost is linear in the number of blocks.
class ResidualBlock {
 public:
  virtual ~ResidualBlock() = default;

  /// r(x) and, if `J` is not null, its exact Jacobian ∂r/∂x.
  /// @param x  The values of this block's parameters, in the order of `parameters()`.
  /// @param r  `size()` x 1. @param J  `size()` x parameters, or null.
  /// @return   Whether r is defined at x; then its entries are finite or the point is refused, too.
  [[nodiscard]] virtual bool evaluate(const Eigen::VectorXd& x, Eigen::VectorXd& r,
                                      Eigen::MatrixXd* J) const = 0;

  /// The number of residuals.
  [[nodiscard]] Eigen::Index size() const noexcept { return size_; }
  /// The places of its parameters among all, each once.
  [[nodiscard]] const std::vector<Eigen::Index>& parameters() const noexcept { return parameters_; }

 protected:
  ResidualBlock(Eigen::Index size, std::vector<Eigen::Index> parameters)
      : size_(size), parameters_(std::move(parameters)) {}
  ResidualBlock(const ResidualBlock&) = default;
  ResidualBlock& operator=(const ResidualBlock&) = default;

 private:
  Eigen::Index size_;
  std::vector<Eigen::Index> parameters_;
};

/// A block of a callable: bool f(const VectorXd& x, VectorXd& r, MatrixXd* J), as `evaluate`.
template <class Function>
class FunctionBlock final : public ResidualBlock {
 public:
  /// @param parameters  Of how many parameters it is, all of them, in order.
  FunctionBlock(Eigen::Index size, Eigen::Index parameters, Function function)
      : ResidualBlock(size, first(parameters)), function_(std::move(function)) {}
  /// @param parameters  The places of its parameters.
  FunctionBlock(Eigen::Index size, std::vector<Eigen::Index> parameters, Function function)
      : ResidualBlock(size, std::move(parameters)), function_(std::move(function)) {}

  [[nodiscard]] bool evaluate(const Eigen::VectorXd& x, Eigen::VectorXd& r,
                              Eigen::MatrixXd* J) const override {
    return function_(x, r, J);
  }

 private:
  static std::vector<Eigen::Index> first(Eigen::Index count) {
    std::vector<Eigen::Index> places;
    for (Eigen::Index i = 0; i < count; ++i) {
      places.push_back(i);
    }
    return places;
  }

  Function function_;
};

/// A block of a callable. @param parameters  Their number, or their places.
template <class Parameters, class Function>
[[nodiscard]] std::shared_ptr<const ResidualBlock> residual_block(Eigen::Index size,
                                                                  Parameters parameters,
                                                                  Function function) {
  return std::make_shared<FunctionBlock<Function>>(size, std::move(parameters),
                                                   std::move(function));
}

/// Minimise Σ ρ(rᵢ(x)²) + Σ ((xⱼ - μⱼ)/σⱼ)² over l ≤ x ≤ u.
struct LeastSquaresProblem {
  std::vector<std::shared_ptr<const ResidualBlock>> blocks{};
  Eigen::VectorXd start{};  ///< n x 1; moved into the bounds.
  /// n x 1 each, or empty: no bounds. Infinite entries are none; equal ones fix a parameter.
  Eigen::VectorXd lower{}, upper{};
  /// n x 1 each, or empty: no priors. An infinite σ is none.
  Eigen::VectorXd prior_mean{}, prior_std{};
  RobustLoss loss{};                 ///< Of the residuals, not of the priors.
  std::vector<std::string> names{};  ///< Of the parameters, for messages; or empty.
};

/// When to stop.
struct LeastSquaresOptions {
  int max_iterations = 500;
  /// The largest `LeastSquaresResult::optimality` that is taken for an optimum.
  double tolerance = 1e-8;
  /// Directions in which the residuals, by columns of norm 1, change less than this share of their
  /// norm do not count to the rank.
  double rank_tolerance = 1e-9;
};

/// Why the iteration ended.
enum class LeastSquaresStop {
  optimal,          ///< The optimality is within its tolerance.
  zero_residual,    ///< The residuals vanish but for rounding.
  rounding,         ///< No step lowers the cost or the optimality by more than rounding.
  iteration_limit,  ///< The cap of the options.
};
[[nodiscard]] std::string_view to_string(LeastSquaresStop stop);

/// What keeps a parameter from moving.
enum class Bound {
  none,
  lower,  ///< At its lower bound, and the cost would fall below it.
  upper,
  fixed,  ///< The bounds are equal.
};

/// A minimum, and what it was checked by.
struct LeastSquaresResult {
  Eigen::VectorXd x{};
  double cost = 0.0;        ///< Σ ρ + Σ priors.
  double start_cost = 0.0;  ///< At the start.
  /// √(what the linearised problem over the bounds could still gain / cost): zero where, and only
  /// where, the first-order conditions hold, whatever the parameters' units; without bounds
  /// the sine of the angle between the residuals and what the parameters reach (Bates and Watts).
  double optimality = 0.0;
  /// The largest component of the projected gradient, each by a column of norm 1: the cost's
  /// coordinate-wise step within the bounds, relative to √cost.
  double projected_gradient = 0.0;
  LeastSquaresStop stop = LeastSquaresStop::iteration_limit;
  /// optimal, zero_residual, or rounding where the optimality or the projected gradient is below
  /// 1e-3.
  bool converged = false;
  Eigen::Index residuals = 0;   ///< Their number; priors do not count.
  Eigen::Index free = 0;        ///< Parameters that are neither fixed nor held by a bound.
  Eigen::Index rank = 0;        ///< Of the Jacobian by those, priors included.
  std::vector<Bound> bounds{};  ///< One a parameter.
  /// n x (free - rank): combinations of parameters that the residuals do not determine, the largest
  /// entry 1, each parameter in units of `scales`.
  Eigen::MatrixXd undetermined{};
  Eigen::VectorXd scales{};  ///< n x 1: the change of each parameter that moves √cost by about 1.
  /// Smallest over largest singular value of the Jacobian by columns of norm 1: the reciprocal
  /// condition, zero where the rank is deficient.
  double reciprocal_condition = 0.0;
  int iterations = 0;   ///< Steps tried.
  int evaluations = 0;  ///< Of the residuals.
  int jacobians = 0;    ///< Of the residuals with their Jacobian.
};

/// A local minimum by Levenberg and Marquardt's method, each step the minimiser of the damped
/// linearised problem over the bounds, found by active sets and orthogonal factors.
///
/// Steps are measured in units of the largest column norms met, so that the units of parameters
/// do not matter. The loss enters with its slope and as much of its bend as keeps the model convex.
/// A point where residuals are not finite is not entered. @param problem  See there.
/// @errors ArgumentError::wrong_shape, not_finite, out_of_range for the problem's parts;
///         LeastSquaresError::no_start with the block and the residual, no_residuals.
/// Cost: an iteration is an evaluation, a QR decomposition of each block and, for the arrow of
/// blocks with shared parameters, one of small triangles; linear in the blocks. Allocates.
/// Source: Moré, "The Levenberg-Marquardt algorithm" (1978), scaling; Nielsen, "Damping parameter
/// in Marquardt's method" (1999); Stark, Parker, "Bounded-variable least-squares" (1995); Triggs et
/// al., "Bundle adjustment - a modern synthesis" (2000), eq. (11); Bates, Watts, "A relative offset
/// orthogonality convergence criterion" (1981).
[[nodiscard]] Expected<LeastSquaresResult> solve_least_squares(
    const LeastSquaresProblem& problem, const LeastSquaresOptions& options = {});

/// Where starts are drawn from, beside the problem's own.
struct MultiStartOptions {
  int starts = 10;  ///< The problem's own included.
  unsigned long long seed = 1;
  /// n x 1 each, finite, or empty: the bounds, where both are finite, and the start itself
  /// elsewhere. A range from a positive number to one ten times as large or more is drawn from
  /// evenly in the logarithm.
  Eigen::VectorXd from{}, to{};
  LeastSquaresOptions each{};
};

/// The best of several minima, and how the others ended.
struct MultiStartResult {
  LeastSquaresResult best{};
  std::vector<double> costs{};  ///< Of each start, ascending; infinite where it could not begin.
  int agreeing = 0;             ///< Starts that ended within 1e-6 of the best cost.
};

/// Starts in a Latin hypercube, each run to its minimum.
/// @errors Those of `solve_least_squares` that no start avoids; ArgumentError for the options.
/// Source: McKay, Beckman, Conover (1979).
[[nodiscard]] Expected<MultiStartResult> solve_from_several_starts(
    const LeastSquaresProblem& problem, const MultiStartOptions& options);

}  // namespace flyball::optimization
