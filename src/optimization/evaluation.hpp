#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <flyball/optimization/least_squares.hpp>

#include "optimization/arrow_system.hpp"

namespace flyball::optimization {

/// The problem's parts fit together. @errors ArgumentError, LeastSquaresError::no_residuals.
[[nodiscard]] Expected<void> check_problem(const LeastSquaresProblem& problem,
                                           std::string_view where);

/// The name of a parameter, or its place.
[[nodiscard]] std::string name_of(const LeastSquaresProblem& problem, Eigen::Index parameter);

/// Evaluates a problem, block by block.
class Evaluator {
 public:
  explicit Evaluator(const LeastSquaresProblem& problem);

  /// Σ ρ + Σ priors, or nothing where a residual is not finite.
  [[nodiscard]] std::optional<double> cost(const VectorXd& x);
  /// The linearised problem, its cost in `cost`; nothing where an entry is not finite.
  [[nodiscard]] std::optional<ArrowSystem> linearize(const VectorXd& x, double& cost);
  /// Calls visit(block, r, J) for each; J by the block's parameters. False where one is not finite.
  template <class Visit>
  bool each(const VectorXd& x, bool with_jacobian, const Visit& visit);

  [[nodiscard]] Index parameters() const noexcept { return problem_.start.size(); }
  [[nodiscard]] Index residuals() const noexcept { return residuals_; }
  [[nodiscard]] const VectorXd& lower() const noexcept { return lower_; }
  [[nodiscard]] const VectorXd& upper() const noexcept { return upper_; }
  /// Whether a parameter stands in one block only, beside others.
  [[nodiscard]] bool is_local(Index parameter) const {
    return local_[static_cast<std::size_t>(parameter)] != 0;
  }
  [[nodiscard]] bool has_prior(Index parameter) const noexcept;
  [[nodiscard]] const LeastSquaresProblem& problem() const noexcept { return problem_; }

  int evaluations = 0;
  int jacobians = 0;
  std::size_t failed_block = 0;  ///< Where an entry was not finite,
  Index failed_residual = -1;    ///< and which; -1: the block said so.

 private:
  bool evaluate(std::size_t block, const VectorXd& x, bool with_jacobian);

  const LeastSquaresProblem& problem_;
  VectorXd lower_, upper_;
  std::vector<char> local_;
  Index residuals_ = 0;
  VectorXd own_, r_;
  MatrixXd J_;
};

template <class Visit>
bool Evaluator::each(const VectorXd& x, bool with_jacobian, const Visit& visit) {
  ++(with_jacobian ? jacobians : evaluations);
  for (std::size_t b = 0; b < problem_.blocks.size(); ++b) {
    if (!evaluate(b, x, with_jacobian)) {
      return false;
    }
    visit(b, r_, J_);
  }
  return true;
}

/// The result of an x that is a minimum or where the iteration ended, but for the iteration's own
/// numbers. @param system  Linearised there.
void describe(const Evaluator& evaluator, const ArrowSystem& system, double rank_tolerance,
              LeastSquaresResult& result);

/// Parameters that the bounds leave free at x, where the half gradient does not press them.
[[nodiscard]] std::vector<Bound> bounds_at(const Evaluator& evaluator, const VectorXd& x,
                                           const VectorXd& half_gradient);

}  // namespace flyball::optimization
