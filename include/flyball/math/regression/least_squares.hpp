#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>

namespace flyball {

/// Why a regression has no answer.
enum class RegressionError {
  infeasible,      ///< The equality constraints contradict each other.
  leverage_one,    ///< A row determines a coefficient alone: its HC2 or HC3 error does not exist.
  no_convergence,  ///< The search for the active bounds reached its cap.
};
[[nodiscard]] ErrorInfo error_info(RegressionError code);

/// What is assumed of the errors ϵ when the errors of the coefficients are computed.
enum class ErrorModel {
  classical,  ///< Independent, of one variance (over the weights).
  hc0,        ///< Independent, of any variances (White).
  hc1,        ///< hc0 times n/(n - p).
  hc2,        ///< ϵ̂²/(1 - leverage).
  hc3,        ///< ϵ̂²/(1 - leverage)²: on the safe side for few rows.
  hac,        ///< Any variances, correlated with their neighbours in time (Newey and West).
};

/// C β = d.
struct EqualityConstraint {
  Eigen::MatrixXd C;  ///< k x p.
  Eigen::VectorXd d;  ///< k.
};

/// How to regress.
struct LeastSquaresOptions {
  std::optional<Eigen::VectorXd> weights{};  ///< n, not negative, as 1/variance; a row of weight 0
                                             ///< does not count.
  std::optional<EqualityConstraint> equality{};
  ErrorModel errors = ErrorModel::classical;
  std::optional<int> lags{};  ///< Of hac: rows over which errors are correlated; else
                              ///< ⌊4 (n/100)^(2/9)⌋.
  double confidence = 0.95;   ///< Of the intervals, in (0, 1).
  double tolerance = 0.0;     ///< Columns of this relative size beside the others, once all are of
                              ///< one length, count as dependent; 0 takes max(n, p) ε.
};

/// What a regression says of its p coefficients.
struct Regression {
  Eigen::VectorXd coefficients;     ///< β̂; the shortest in units of the columns where some are not
                                    ///< determined.
  Eigen::MatrixXd covariance;       ///< p x p, of what is determined.
  Eigen::VectorXd standard_errors;  ///< Infinite for what is not determined, and without degrees of
                                    ///< freedom.
  Eigen::MatrixXd intervals;        ///< p x 2, by Student's t.
  Eigen::VectorXd p_values;         ///< Of |t| as large as β̂/error or larger if β were 0.
  Eigen::Index rank = 0;
  std::vector<bool> determined;         ///< p: whether the data tell the coefficient.
  Eigen::MatrixXd undetermined;         ///< p x (p - rank): along them β changes no prediction.
  double condition = 0.0;               ///< Of X with columns of one length.
  Eigen::Index rows = 0;                ///< Those that count.
  Eigen::Index degrees_of_freedom = 0;  ///< rows - rank.
  double residual_squares = 0.0;        ///< Σ w (y - ŷ)².
  double variance = 0.0;  ///< That over the degrees of freedom: of ϵ. NaN without any.
  /// 1 - residual_squares / Σ w (y - mean)²; without the mean where no combination of the columns
  /// is constant.
  double r_squared = 0.0;
  double adjusted_r_squared = 0.0;
};

/// A regression whose rows are at hand.
struct LeastSquares : Regression {
  Eigen::VectorXd residuals;   ///< n, y - X β̂.
  Eigen::VectorXd leverage;    ///< n, dŷ_i/dy_i: near 1 where a row decides alone.
  double durbin_watson = 0.0;  ///< Near 2 where neighbouring residuals are uncorrelated.
};

/// The β̂ that minimises Σ w (y - X β)²: ordinary least squares (14.1), weighted and constrained,
/// with the errors of the coefficients and with what the data do not determine.
///
/// Householder QR with column pivoting of X, its columns scaled to one length by powers of two, so
/// that no unit matters. Where X is badly conditioned and of full rank, β̂ is corrected with
/// residuals in twice the working precision until it is that of the given doubles to their last
/// digits. Constraints are eliminated by an orthogonal basis of their null space.
///
/// @param X  n x p. @param y  n.
/// @errors ArgumentError for shapes, entries, options; RegressionError::infeasible, leverage_one.
/// Cost: O(n p²), allocates. Source: book, section 14.1; Golub and Van Loan, "Matrix
/// Computations", sections 5.3 to 5.5 and 6.2; Björck, BIT 7 (1967) (correction); White,
/// Econometrica 48 (1980) and MacKinnon and White, J. Econometrics 29 (1985) (hc0 to hc3); Newey
/// and West, Econometrica 55 (1987) (hac).
[[nodiscard]] Expected<LeastSquares> least_squares(const MatrixRef& X, const MatrixRef& y,
                                                   const LeastSquaresOptions& options = {});

}  // namespace flyball
