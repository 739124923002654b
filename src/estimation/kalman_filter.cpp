#include <flyball/estimation/kalman_filter.tpp>

#include <cmath>
#include <string>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace detail {

namespace {

/// Whether the factors of P that are not negative are all of it.
Expected<void> check_covariance(const Eigen::MatrixXd& P, std::string_view where,
                                std::string_view name) {
  constexpr double rounding = 1e-8;
  const Eigen::VectorXd variances = P.diagonal();
  Eigen::MatrixXd U;
  Eigen::VectorXd d;
  ud_factorize(P, U, d);
  Eigen::MatrixXd product(P.rows(), P.cols());
  ud_product(U, d, product);
  for (Eigen::Index j = 0; j < P.cols(); ++j) {
    if (!(std::abs(variances(j)) <= largest_variance)) {
      return refusal(ArgumentError::out_of_range, where, detail::format("{}({}, {})", name, j, j))
          .got(format_number(variances(j)))
          .expected("a variance of at most 1e200");
    }
    for (Eigen::Index i = 0; i <= j; ++i) {
      const double size = std::sqrt(std::abs(variances(i))) * std::sqrt(std::abs(variances(j)));
      if (!(std::abs(product(i, j) - P(i, j)) <= rounding * size)) {
        return refusal(ArgumentError::out_of_range, where, name)
            .got(detail::format("negative in some direction: row {} and column {} show it", i, j))
            .expected("positive semidefinite, as every covariance is");
      }
    }
  }
  return {};
}

}  // namespace

Expected<void> check_kalman_filter(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                                   const MatrixRef& D, Time period, const Covariance& Q,
                                   const Covariance& R, const Covariance& P0) {
  constexpr std::string_view where = "KalmanFilter";
  for (const Covariance* covariance : {&Q, &R, &P0}) {
    FLYBALL_CHECK(covariance->get());
  }
  FLYBALL_CHECK(check_system(A, B, C, D, where));
  FLYBALL_CHECK(check_positive(period.si(), where, "period", "s"));
  const Eigen::Index n = A.rows();
  const Eigen::Index p = C.rows();
  const Eigen::MatrixXd& Q0 = *Q.get();
  const Eigen::MatrixXd& R0 = *R.get();
  const Eigen::MatrixXd& P = *P0.get();
  FLYBALL_CHECK(Checks(where)
                    .shape(Q0, n, n, "Q", "states x states")
                    .shape(R0, p, p, "R", "outputs x outputs")
                    .shape(P, n, n, "P0", "states x states"));
  return Checks(where)
      .finite(Q0, "Q")
      .finite(R0, "R")
      .finite(P, "P0")
      .symmetric(Q0, "Q")
      .symmetric(R0, "R")
      .symmetric(P, "P0")
      .also([&] { return check_covariance(Q0, where, "Q"); })
      .also([&] { return check_covariance(R0, where, "R"); })
      .also([&] { return check_covariance(P, where, "P0"); });
}

}  // namespace detail

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs) \
  template class KalmanFilter<States, Inputs, Outputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
