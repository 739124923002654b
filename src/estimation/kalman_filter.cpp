#include <flyball/estimation/kalman_filter.tpp>

#include "core/try.hpp"

namespace flyball {

namespace detail {

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
      .symmetric(P, "P0");
}

}  // namespace detail

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs) \
  template class KalmanFilter<States, Inputs, Outputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
