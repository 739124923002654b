#include <flyball/estimation/kalman_filter.tpp>

namespace flyball {

namespace detail {

Expected<void> check_kalman_filter(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                                   const MatrixRef& D, Time period, const Covariance& Q,
                                   const Covariance& R, const Covariance& P0) {
  constexpr std::string_view where = "KalmanFilter";
  for (const Covariance* covariance : {&Q, &R, &P0}) {
    if (!covariance->get()) {
      return tl::unexpected(covariance->get().error());
    }
  }
  if (auto checked = check_system(A, B, C, D, where); !checked) {
    return checked;
  }
  if (auto checked = check_positive(period.si(), where, "period", "s"); !checked) {
    return checked;
  }
  const Eigen::Index n = A.rows();
  const Eigen::Index p = C.rows();
  const Eigen::MatrixXd& Q0 = *Q.get();
  const Eigen::MatrixXd& R0 = *R.get();
  const Eigen::MatrixXd& P = *P0.get();
  if (auto checked = check_all(check_shape(Q0, n, n, where, "Q", "states x states"),
                               check_shape(R0, p, p, where, "R", "outputs x outputs"),
                               check_shape(P, n, n, where, "P0", "states x states"));
      !checked) {
    return checked;
  }
  return check_all(check_finite(Q0, where, "Q"), check_finite(R0, where, "R"),
                   check_finite(P, where, "P0"), check_symmetric(Q0, where, "Q"),
                   check_symmetric(R0, where, "R"), check_symmetric(P, where, "P0"));
}

}  // namespace detail

template class KalmanFilter<1, 1, 1>;
template class KalmanFilter<2, 1, 1>;
template class KalmanFilter<2, 1, 2>;
template class KalmanFilter<2, 2, 2>;
template class KalmanFilter<3, 1, 1>;
template class KalmanFilter<3, 1, 2>;
template class KalmanFilter<Eigen::Dynamic, Eigen::Dynamic, Eigen::Dynamic>;

}  // namespace flyball
