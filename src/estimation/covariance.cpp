#include <flyball/estimation/covariance.hpp>

#include <cmath>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

Expected<Eigen::MatrixXd> standard_deviations(std::span<const double> sigmas) {
  constexpr std::string_view where = "standard_deviations";
  if (sigmas.empty()) {
    return refusal(ArgumentError::empty, where, "sigmas")
        .got("empty")
        .expected("one standard deviation a state or output");
  }
  const auto n = static_cast<Eigen::Index>(sigmas.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double sigma = sigmas[static_cast<std::size_t>(i)];
    FLYBALL_CHECK(check_not_negative(sigma, where, detail::format("standard deviation {}", i)));
    covariance(i, i) = sigma * sigma;
  }
  return covariance;
}

Expected<Eigen::MatrixXd> standard_deviations(std::initializer_list<double> sigmas) {
  return standard_deviations(std::span<const double>(sigmas.begin(), sigmas.size()));
}

Expected<void> check_covariance(const MatrixRef& S, std::string_view where, std::string_view name) {
  constexpr double rounding = 1e-12;
  FLYBALL_CHECK(Checks(where).finite(S, name).symmetric(S, name));
  const Eigen::Index n = S.rows();
  if (n == 0) {
    return {};
  }
  // Correlations: in units in which each variance is one.
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < n; ++i) {
      if (S(i, i) > 0.0 && S(j, j) > 0.0) {
        correlation(i, j) = S(i, j) / std::sqrt(S(i, i)) / std::sqrt(S(j, j));
      } else if (i == j && S(i, i) < 0.0) {
        correlation(i, i) = -1.0;
      } else if (S(i, j) != 0.0) {
        correlation(i, j) = S(i, j) > 0.0 ? 1.0 : -1.0;  // Without a variance of its own.
      }
    }
  }
  const double least =
      detail::symmetric_eigensystem_of(detail::symmetrized(correlation)).values.minCoeff();
  if (least >= -rounding * static_cast<double>(n)) {
    return {};
  }
  return tl::unexpected(Error(ArgumentError::not_positive)
                            .in(std::string(where))
                            .about(std::string(name))
                            .got("no covariance: along some direction its variance is negative")
                            .expected("positive semidefinite")
                            .with("that variance, of variances scaled to one", least));
}

namespace detail {

Expected<void> unusable_state(std::string_view where, std::string_view name) {
  return refusal(ArgumentError::not_finite, where, name)
      .got("an entry that is NaN, infinite or beyond 1e100")
      .expected("finite numbers");
}

Expected<void> unusable_covariance(std::string_view where, std::string_view name) {
  return refusal(ArgumentError::out_of_range, where, name)
      .got("a covariance that this form cannot carry")
      .expected(
          "variances of at most 1e200, and for an information form none of zero in any direction");
}

}  // namespace detail

}  // namespace flyball
