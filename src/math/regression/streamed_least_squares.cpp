#include <flyball/math/regression/streamed_least_squares.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <flyball/core/signal.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/regression/decomposition.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

StreamedLeastSquares::StreamedLeastSquares(Index coefficients)
    : R_(MatrixXd::Zero(coefficients + 2, coefficients + 2)),
      block_(std::max<Index>(64, 2 * coefficients), coefficients + 2) {}

Expected<StreamedLeastSquares> StreamedLeastSquares::create(Index coefficients) {
  if (coefficients < 1 || coefficients > 10'000) {
    return refusal(ArgumentError::out_of_range, "StreamedLeastSquares", "coefficients")
        .got(std::to_string(coefficients))
        .expected("from 1 to 10000");
  }
  return StreamedLeastSquares(coefficients);
}

/// Column by column a reflection takes what stands in the block into R.
void StreamedLeastSquares::fold(MatrixXd& R, MatrixXd& block, Index used) const noexcept {
  const Index columns = R.cols();
  for (Index k = 0; k < columns; ++k) {
    auto v = block.col(k).head(used);
    const double below = v.squaredNorm();
    if (below == 0.0) {
      continue;
    }
    const double diagonal = R(k, k);
    const double norm = std::copysign(std::sqrt(diagonal * diagonal + below), diagonal);
    // v = (diagonal + norm, block), I - v vᵀ / (norm (norm + diagonal)).
    const double head = diagonal + norm;
    const double factor = 1.0 / (norm * head);
    R(k, k) = -norm;
    for (Index j = k + 1; j < columns; ++j) {
      auto column = block.col(j).head(used);
      const double share = factor * (head * R(k, j) + v.dot(column));
      R(k, j) -= share * head;
      column -= share * v;
    }
  }
}

bool StreamedLeastSquares::add(const double* x, double y, double weight) noexcept {
  const Index p = R_.cols() - 2;
  bool usable = is_signal(y) && is_signal(weight) && weight >= 0.0;
  for (Index j = 0; j < p; ++j) {
    usable = usable && is_signal(x[j]);
  }
  if (!usable) {
    return false;
  }
  if (weight == 0.0) {
    return true;
  }
  const double root = std::sqrt(weight);
  for (Index j = 0; j < p; ++j) {
    block_(waiting_, j) = root * x[j];
  }
  block_(waiting_, p) = root;
  block_(waiting_, p + 1) = root * y;
  weight_ += weight;
  const double change = y - mean_;
  mean_ += change * (weight / weight_);
  square_ += weight * change * (y - mean_);
  ++rows_;
  if (++waiting_ == block_.rows()) {
    fold(R_, block_, waiting_);
    waiting_ = 0;
  }
  return true;
}

Expected<void> StreamedLeastSquares::add(const MatrixRef& X, const MatrixRef& y) {
  constexpr std::string_view where = "StreamedLeastSquares";
  const Index p = R_.cols() - 2;
  FLYBALL_CHECK(Checks(where)
                    .shape(X, X.rows(), p, "X", "rows x coefficients")
                    .shape(y, X.rows(), 1, "y", "rows of X"));
  if (!is_signal(X) || !is_signal(y)) {
    return refusal(ArgumentError::not_finite, where, "a row").expected("numbers of at most 1e100");
  }
  const MatrixXd rows = X.transpose();
  for (Index i = 0; i < X.rows(); ++i) {
    add(rows.col(i).data(), y(i, 0));
  }
  return {};
}

Expected<void> StreamedLeastSquares::merge(const StreamedLeastSquares& other) {
  if (other.R_.cols() != R_.cols()) {
    return refusal(ArgumentError::wrong_shape, "StreamedLeastSquares", "the other")
        .got(detail::format("of {} coefficients", other.R_.cols() - 2))
        .expected(detail::format("of {}", R_.cols() - 2));
  }
  MatrixXd triangle = other.R_;
  MatrixXd block = other.block_.topRows(other.waiting_);
  fold(R_, triangle, triangle.rows());
  fold(R_, block, block.rows());
  const double weight = weight_ + other.weight_;
  if (other.weight_ > 0.0) {
    const double change = other.mean_ - mean_;
    square_ += other.square_ + change * change * weight_ * (other.weight_ / weight);
    mean_ += change * (other.weight_ / weight);
  }
  weight_ = weight;
  rows_ += other.rows_;
  return {};
}

MatrixXd StreamedLeastSquares::factor() const {
  MatrixXd R = R_;
  MatrixXd block = block_;
  fold(R, block, waiting_);
  return R;
}

Expected<Regression> StreamedLeastSquares::solve(double confidence, double tolerance) const {
  constexpr std::string_view where = "StreamedLeastSquares";
  FLYBALL_CHECK(detail::check_confidence(confidence, tolerance, where));
  if (rows_ == 0) {
    return refusal(ArgumentError::empty, where, "the regression").expected("given rows");
  }
  const Index p = R_.cols() - 2;
  const MatrixXd R = factor();
  const double relative = tolerance > 0.0 ? tolerance
                                          : static_cast<double>(std::max(rows_, p)) *
                                                std::numeric_limits<double>::epsilon();
  const detail::RegressorDecomposition of =
      detail::decompose_regressors(R.leftCols(p), std::min(relative, 1e-9));
  Regression fit;
  fit.rows = rows_;
  fit.rank = of.Q.cols();
  fit.determined = of.determined;
  fit.undetermined = of.null;
  fit.condition = of.condition;
  fit.degrees_of_freedom = fit.rows - fit.rank;
  fit.coefficients = of.S * (of.Q.transpose() * R.col(p + 1));
  fit.residual_squares = (R.col(p + 1) - R.leftCols(p) * fit.coefficients).squaredNorm();
  fit.variance = fit.degrees_of_freedom > 0
                     ? fit.residual_squares / static_cast<double>(fit.degrees_of_freedom)
                     : std::numeric_limits<double>::quiet_NaN();
  fit.covariance = detail::symmetrized(fit.degrees_of_freedom > 0
                                           ? MatrixXd(fit.variance * of.S * of.S.transpose())
                                           : MatrixXd::Constant(p, p, fit.variance));
  detail::tell_intervals(fit, confidence);
  const VectorXd ones = R.col(p);
  const bool centred = (ones - of.Q * (of.Q.transpose() * ones)).norm() <= 1e-8 * ones.norm();
  detail::tell_r_squared(fit, centred ? square_ : R.col(p + 1).squaredNorm(), centred);
  return fit;
}

}  // namespace flyball
