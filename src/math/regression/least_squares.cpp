#include <flyball/math/regression/least_squares.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/regression/decomposition.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::string_view in_least_squares = "least_squares";

Expected<void> check(const MatrixRef& X, const MatrixRef& y, const LeastSquaresOptions& options) {
  FLYBALL_CHECK(Checks(in_least_squares)
                    .finite(X, "X")
                    .shape(y, X.rows(), 1, "y", "rows of X")
                    .finite(y, "y"));
  if (X.size() == 0) {
    return refusal(ArgumentError::empty, in_least_squares, "X").expected("rows x coefficients");
  }
  FLYBALL_CHECK(detail::check_confidence(options.confidence, options.tolerance, in_least_squares));
  if (options.weights) {
    FLYBALL_CHECK(Checks(in_least_squares)
                      .shape(*options.weights, X.rows(), 1, "weights", "rows of X")
                      .finite(*options.weights, "weights"));
    if (Index i = 0; options.weights->minCoeff(&i) < 0.0) {
      return refusal(ArgumentError::out_of_range, in_least_squares, detail::format("weight {}", i))
          .got(format_number((*options.weights)(i)))
          .expected("not negative");
    }
  }
  if (options.equality) {
    FLYBALL_CHECK(Checks(in_least_squares)
                      .shape(options.equality->C, options.equality->C.rows(), X.cols(), "C",
                             "constraints x coefficients")
                      .finite(options.equality->C, "C")
                      .shape(options.equality->d, options.equality->C.rows(), 1, "d", "constraints")
                      .finite(options.equality->d, "d"));
  }
  if (options.lags && *options.lags < 0) {
    return refusal(ArgumentError::out_of_range, in_least_squares, "lags")
        .got(std::to_string(*options.lags))
        .expected("not negative");
  }
  return {};
}

/// The β that satisfy C β = d: offset + basis γ, for any γ.
struct Feasible {
  VectorXd offset;
  MatrixXd basis;  ///< Orthonormal in units of the columns of X.
};

Expected<Feasible> feasible(const MatrixRef& X, const EqualityConstraint& equality) {
  const VectorXd units = detail::column_units(X);
  MatrixXd C = equality.C * units.asDiagonal();
  VectorXd d = equality.d;
  for (Index i = 0; i < C.rows(); ++i) {
    const double norm = C.row(i).stableNorm();
    if (norm > 0.0) {
      C.row(i) /= norm;
      d(i) /= norm;
    }
  }
  // Cᵀ = Q R: C β = d fixes β along as many leading columns of Q as R has rows.
  const detail::OrthogonalTriangular qr = detail::pivoted_qr(C.transpose());
  constexpr double tolerance = 1e-12;
  Index rank = 0;
  while (rank < std::min(qr.R.rows(), qr.R.cols()) && std::abs(qr.R(rank, rank)) > tolerance) {
    ++rank;
  }
  const VectorXd offset = detail::solve_least_squares(C, d);
  const double gap = (C * offset - d).norm();
  if (gap > 1e-10 * std::max(d.norm(), offset.norm())) {
    return refusal(RegressionError::infeasible, in_least_squares, "C β = d")
        .hint("give equations that hold together")
        .with("distance", gap);
  }
  return Feasible{units.asDiagonal() * offset,
                  units.asDiagonal() * qr.Q.rightCols(X.cols() - rank)};
}

/// Σ q_i q_iᵀ e_i², with what the model of the errors makes of it; `score` holds e_i q_i in rows.
MatrixXd long_run_covariance(const MatrixXd& score, int lags) {
  MatrixXd sum = detail::transposed_product(score, score);
  const Index n = score.rows();
  for (Index lag = 1; lag <= std::min<Index>(lags, n - 1); ++lag) {
    const double bartlett = 1.0 - static_cast<double>(lag) / (static_cast<double>(lags) + 1.0);
    const MatrixXd cross =
        detail::transposed_product(score.bottomRows(n - lag), score.topRows(n - lag));
    sum += bartlett * (cross + cross.transpose());
  }
  return sum;
}

/// Of the coefficients in the basis Q. @param e  The weighted residuals.
Expected<MatrixXd> covariance_of(const MatrixXd& Q, const VectorXd& e, const VectorXd& leverage,
                                 const Regression& regression, const LeastSquaresOptions& options) {
  if (options.errors == ErrorModel::classical) {
    return MatrixXd(regression.variance * MatrixXd::Identity(Q.cols(), Q.cols()));
  }
  const auto n = static_cast<double>(regression.rows);
  const double correction = n / static_cast<double>(regression.degrees_of_freedom);
  VectorXd scaled = e;
  if (options.errors == ErrorModel::hc2 || options.errors == ErrorModel::hc3) {
    Index row = 0;
    if (leverage.maxCoeff(&row) > 1.0 - 1e-10) {
      return refusal(RegressionError::leverage_one, in_least_squares,
                     detail::format("row {} of X", row))
          .hint("take hc1, or leave the row and its coefficient out")
          .with("row", static_cast<double>(row));
    }
    const auto left = (1.0 - leverage.array());
    scaled = options.errors == ErrorModel::hc2 ? VectorXd(e.array() / left.sqrt())
                                               : VectorXd(e.array() / left);
  }
  const int lags =
      options.errors != ErrorModel::hac
          ? 0
          : options.lags.value_or(static_cast<int>(4.0 * std::pow(n / 100.0, 2.0 / 9.0)));
  const bool corrected = options.errors == ErrorModel::hc1 || options.errors == ErrorModel::hac;
  return MatrixXd((corrected ? correction : 1.0) *
                  long_run_covariance(scaled.asDiagonal() * Q, lags));
}

}  // namespace

Expected<LeastSquares> least_squares(const MatrixRef& X, const MatrixRef& y,
                                     const LeastSquaresOptions& options) {
  FLYBALL_CHECK(check(X, y, options));
  const Index p = X.cols();
  MatrixXd regressors = X;
  VectorXd target = y;
  std::optional<Feasible> set;
  if (options.equality) {
    FLYBALL_TRY(set, feasible(X, *options.equality));
    regressors = X * set->basis;
    target -= X * set->offset;
  }
  VectorXd constant = VectorXd::Ones(X.rows());
  if (options.weights) {
    constant = options.weights->cwiseSqrt();
    regressors = constant.asDiagonal() * regressors;
    target = target.cwiseProduct(constant);
  }

  LeastSquares fit;
  fit.rows = (constant.array() > 0.0).count();
  MatrixXd Q(X.rows(), 0);
  MatrixXd S(p, 0);
  fit.coefficients = set ? set->offset : VectorXd::Zero(p);
  fit.determined.assign(static_cast<std::size_t>(p), true);
  fit.undetermined.resize(p, 0);
  fit.condition = 1.0;
  if (regressors.cols() > 0) {
    detail::RegressorDecomposition of = detail::decompose_regressors(regressors, options.tolerance);
    const bool correct =
        of.S.cols() == regressors.cols() && of.condition > 1e3 && regressors.size() <= 2'000'000;
    const VectorXd gamma = correct ? detail::refined_solution(regressors, target, of)
                                   : VectorXd(of.S * (of.Q.transpose() * target));
    fit.coefficients += set ? VectorXd(set->basis * gamma) : gamma;
    fit.condition = of.condition;
    S = set ? MatrixXd(set->basis * of.S) : of.S;
    Q = std::move(of.Q);
    fit.determined = of.determined;
    fit.undetermined = of.null;
    if (set) {
      fit.undetermined = set->basis * of.null;
      const VectorXd units = detail::column_units(X);
      for (Index j = 0; j < p; ++j) {
        fit.determined[static_cast<std::size_t>(j)] =
            fit.undetermined.row(j).norm() <=
            1e-8 * units(j) *
                fit.undetermined.cwiseQuotient(units.replicate(1, fit.undetermined.cols())).norm();
      }
    }
  }
  fit.rank = Q.cols();
  fit.degrees_of_freedom = fit.rows - fit.rank;
  fit.residuals = y - X * fit.coefficients;
  fit.leverage = Q.rowwise().squaredNorm();

  const VectorXd e = fit.residuals.cwiseProduct(constant);
  fit.residual_squares = e.squaredNorm();
  fit.variance = fit.degrees_of_freedom > 0
                     ? fit.residual_squares / static_cast<double>(fit.degrees_of_freedom)
                     : std::numeric_limits<double>::quiet_NaN();
  FLYBALL_TRY(const MatrixXd inner, covariance_of(Q, e, fit.leverage, fit, options));
  fit.covariance = detail::symmetrized(S * inner * S.transpose());
  detail::tell_intervals(fit, options.confidence);

  // Whether ŷ may be any constant: then R² compares with the mean.
  const bool centred =
      (constant - Q * (Q.transpose() * constant)).norm() <= 1e-8 * constant.norm() && !set;
  const double mean =
      centred ? VectorXd(y).dot(constant.cwiseAbs2()) / constant.squaredNorm() : 0.0;
  detail::tell_r_squared(
      fit, (VectorXd(y).array() - mean).matrix().cwiseProduct(constant).squaredNorm(), centred);
  const Index n = X.rows();
  fit.durbin_watson = fit.residual_squares > 0.0
                          ? (e.tail(n - 1) - e.head(n - 1)).squaredNorm() / fit.residual_squares
                          : 2.0;
  return fit;
}

}  // namespace flyball
