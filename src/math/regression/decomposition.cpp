#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/QR>

#include <flyball/math/probability/distributions.hpp>

#include "core/constants.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/extended/double_double.hpp"
#include "math/regression/decomposition.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

ErrorInfo error_info(RegressionError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"infeasible", "the equality constraints contradict each other", ErrorKind::no_answer},
      {"leverage_one", "a row determines a coefficient alone", ErrorKind::no_answer},
      {"no_convergence", "the iterations reached their cap", ErrorKind::no_answer},
  };
  return detail::info_of(code, "regression", rows);
}

namespace detail {

VectorXd column_units(const MatrixRef& X) {
  VectorXd units(X.cols());
  for (Index j = 0; j < X.cols(); ++j) {
    const double norm = X.col(j).stableNorm();
    units(j) = norm > 0.0 ? std::ldexp(1.0, -std::ilogb(norm)) : 1.0;
  }
  return units;
}

RegressorDecomposition decompose_regressors(const MatrixRef& X, double tolerance) {
  const Index p = X.cols();
  const VectorXd units = column_units(X);
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(X * units.asDiagonal());
  const MatrixXd R = qr.matrixQR().topRows(std::min(X.rows(), p)).triangularView<Eigen::Upper>();
  const double relative = tolerance > 0.0 ? tolerance
                                          : static_cast<double>(std::max(X.rows(), p)) *
                                                std::numeric_limits<double>::epsilon();
  Index rank = 0;
  while (rank < R.rows() && std::abs(R(rank, rank)) > relative * std::abs(R(0, 0))) {
    ++rank;
  }
  RegressorDecomposition result;
  result.Q = MatrixXd::Identity(X.rows(), rank);
  result.Q.applyOnTheLeft(qr.householderQ());
  MatrixXd S(p, rank);
  MatrixXd null = MatrixXd::Zero(p, p - rank);
  if (rank == p) {
    S = R.topLeftCorner(p, p).triangularView<Eigen::Upper>().solve(MatrixXd::Identity(p, p));
  } else {
    // [R₁₁ R₁₂] = Tᵀ Zᵀ: the shortest solution is Z₁ T⁻ᵀ c, and Z₂ spans what changes nothing.
    const OrthogonalTriangular rows = full_qr(R.topRows(rank).transpose());
    S = rows.Q.leftCols(rank) *
        rows.R.topRows(rank).transpose().triangularView<Eigen::Lower>().solve(
            MatrixXd::Identity(rank, rank));
    null = rows.Q.rightCols(p - rank);
  }
  const MatrixXd null_of = qr.colsPermutation() * null;
  result.S = units.asDiagonal() * (qr.colsPermutation() * S);
  result.null = units.asDiagonal() * null_of;
  const VectorXd largest = result.null.colwise().stableNorm();
  for (Index j = 0; j < result.null.cols(); ++j) {
    result.null.col(j) /= largest(j);
  }
  for (Index j = 0; j < p; ++j) {
    result.determined.push_back(null_of.row(j).norm() < 1e-8);
  }
  const VectorXd singular = rank > 0 ? singular_values_of(R.topRows(rank)) : VectorXd();
  result.condition = rank > 0 ? singular(0) / singular(rank - 1) : 1.0;
  return result;
}

VectorXd refined_solution(const MatrixRef& X, const MatrixRef& y,
                          const RegressorDecomposition& of) {
  // r + Xβ = y, Xᵀr = 0, whose residuals f and g are formed in twice the precision:
  // δβ = S (Qᵀf - Sᵀg), δr = f - Q (Qᵀf - Sᵀg).
  VectorXd beta = of.S * (of.Q.transpose() * y);
  DoubleDoubleMatrix b{MatrixXd(beta)};
  DoubleDoubleMatrix r{MatrixXd(y - X * beta)};
  const DoubleDoubleMatrix X_two{MatrixXd(X)};
  const DoubleDoubleMatrix y_two{MatrixXd(y)};
  const VectorXd units = column_units(X).cwiseInverse();
  double last = std::numeric_limits<double>::infinity();
  for (int step = 0; step < 12; ++step) {
    const MatrixXd f = add_product(sum(y_two, -1.0, r), -1.0, X_two, b).rounded();
    const MatrixXd g = -product(X_two.transpose(), r).rounded();
    const VectorXd c = of.Q.transpose() * f - of.S.transpose() * g;
    const VectorXd change = of.S * c;
    const double size = change.cwiseProduct(units).norm();
    if (!(size < 0.5 * last)) {
      break;
    }
    last = size;
    b = sum(b, 1.0, DoubleDoubleMatrix(MatrixXd(change)));
    r = sum(r, 1.0, DoubleDoubleMatrix(MatrixXd(f - of.Q * c)));
    beta = b.rounded();
    if (size <= 1e-18 * beta.cwiseProduct(units).norm()) {
      break;
    }
  }
  return beta;
}

void tell_intervals(Regression& regression, double confidence) {
  const Index p = regression.coefficients.size();
  const auto freedom = static_cast<double>(regression.degrees_of_freedom);
  const double width =
      freedom > 0.0 ? student_quantile(0.5 * (1.0 + confidence), freedom) : infinity;
  regression.standard_errors.resize(p);
  regression.intervals.resize(p, 2);
  regression.p_values.resize(p);
  for (Index j = 0; j < p; ++j) {
    const bool known = regression.determined[static_cast<std::size_t>(j)] && freedom > 0.0;
    const double value = regression.coefficients(j);
    const double error = known ? std::sqrt(std::max(regression.covariance(j, j), 0.0)) : infinity;
    const double half = known ? width * error : infinity;
    regression.standard_errors(j) = error;
    regression.intervals.row(j) << value - half, value + half;
    const double t = error > 0.0 ? std::abs(value) / error : value == 0.0 ? 0.0 : infinity;
    regression.p_values(j) = known ? 2.0 * student_cdf(-t, freedom) : 1.0;
  }
}

void tell_r_squared(Regression& regression, double total, bool centred) {
  const auto free_total = static_cast<double>(regression.rows - (centred ? 1 : 0));
  const auto freedom = static_cast<double>(regression.degrees_of_freedom);
  const double left = total > 0.0 ? regression.residual_squares / total : 0.0;
  regression.r_squared = 1.0 - left;
  regression.adjusted_r_squared =
      freedom > 0.0 ? 1.0 - left * free_total / freedom : std::numeric_limits<double>::quiet_NaN();
}

Expected<void> check_confidence(double confidence, double tolerance, std::string_view where) {
  FLYBALL_CHECK(check_within(tolerance, 0.0, 0.5, where, "tolerance"));
  if (!(confidence > 0.0 && confidence < 1.0)) {
    return refusal(ArgumentError::out_of_range, where, "confidence")
        .got(format_number(confidence))
        .expected("between 0 and 1");
  }
  return {};
}

}  // namespace detail

}  // namespace flyball
