#include <flyball/control/parameter_ellipsoid.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <flyball/math/probability/distributions.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Expected<ParameterSet> parameter_ellipsoid(const std::vector<double>& low,
                                           const std::vector<double>& high,
                                           const MatrixRef& covariance, double probability) {
  constexpr std::string_view where = "parameter_ellipsoid";
  FLYBALL_TRY_IN(where, auto box, parameter_box(low, high));
  const Index count = box.centre.size();
  FLYBALL_CHECK(Checks(where)
                    .shape(covariance, count, count, "covariance", "parameters x parameters")
                    .finite(covariance, "covariance")
                    .symmetric(covariance, "covariance")
                    .finite(probability, "probability"));
  if (!(probability > 0.0) || !(probability < 1.0)) {
    return refusal(ArgumentError::out_of_range, where, "probability")
        .got(format_number(probability))
        .expected("between 0 and 1, such as 0.95");
  }
  std::vector<Index> estimated;
  for (Index i = 0; i < count; ++i) {
    if (covariance(i, i) == 0.0 && covariance.row(i).isZero(0.0)) {
      continue;
    }
    if (!(covariance(i, i) > 0.0)) {
      return refusal(ArgumentError::not_positive, where, detail::format("variance {}", i))
          .got(format_number(covariance(i, i)))
          .expected("positive, or a row of zeros");
    }
    const auto at = static_cast<std::size_t>(i);
    if (low[at] != high[at]) {
      return refusal(ArgumentError::out_of_range, where, detail::format("parameter {}", i))
          .got(format_number(low[at]) + " to " + format_number(high[at]) + " beside a variance")
          .expected("its estimate, as low and as high");
    }
    estimated.push_back(i);
  }
  const auto n = static_cast<Index>(estimated.size());
  if (n == 0) {
    return box;
  }
  // In standard errors: the axes of the correlations.
  const auto at = [&](Index i) { return estimated[static_cast<std::size_t>(i)]; };
  VectorXd deviation(n);
  for (Index i = 0; i < n; ++i) {
    deviation(i) = std::sqrt(covariance(at(i), at(i)));
  }
  MatrixXd correlation(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      correlation(i, j) = covariance(at(i), at(j)) / deviation(i) / deviation(j);
    }
  }
  const auto eigen = detail::symmetric_eigensystem_of(detail::symmetrized(correlation));
  constexpr double rounding = 1e-13;
  constexpr double digits = 1e-9;  // As a printed covariance keeps them.
  if (!(eigen.values(0) > -digits)) {
    return refusal(ArgumentError::not_positive, where, "covariance")
        .got("of a negative variance in some direction")
        .expected("positive semidefinite")
        .with("least eigenvalue of the correlations", eigen.values(0));
  }
  const double reach =
      std::sqrt(chi_squared_quantile(probability, static_cast<double>(n))) * (1.0 + 1e-9);
  ParameterSet set{box.centre, MatrixXd::Zero(count, n + box.axes.cols()), n};
  for (Index k = 0; k < n; ++k) {
    const double size = reach * std::sqrt(std::max(eigen.values(k), 0.0) + rounding);
    for (Index i = 0; i < n; ++i) {
      set.axes(at(i), k) = size * deviation(i) * eigen.vectors(i, k);
    }
  }
  set.axes.rightCols(box.axes.cols()) = box.axes;
  return set;
}

}  // namespace flyball
