#include <flyball/estimation/kalman_gain.hpp>

#include <string>

#include <flyball/math/riccati.hpp>

#include "math/dense.hpp"

namespace flyball {

Expected<KalmanGain<>> kalman_gain(const MatrixRef& A, const MatrixRef& C, const Covariance& Q,
                                   const Covariance& R) {
  constexpr std::string_view where = "kalman_gain";
  if (!Q.get()) {
    return tl::unexpected(Q.get().error());
  }
  if (!R.get()) {
    return tl::unexpected(R.get().error());
  }
  const Eigen::MatrixXd& noise_Q = *Q.get();
  const Eigen::MatrixXd& noise_R = *R.get();
  if (auto square = check_square(A, where, "A"); !square) {
    return tl::unexpected(square.error());
  }
  const Eigen::Index n = A.rows();
  const Eigen::Index p = C.rows();
  if (auto checked = check_all(check_shape(C, p, n, where, "C", "outputs x states"),
                               check_shape(noise_Q, n, n, where, "Q", "states x states"),
                               check_shape(noise_R, p, p, where, "R", "outputs x outputs"));
      !checked) {
    return tl::unexpected(checked.error());
  }

  auto dual = dare(A.transpose(), C.transpose(), noise_Q, noise_R);
  if (!dual) {
    Error error = std::move(dual.error()).in(std::string(where));
    if (error.is(RiccatiError::not_stabilizable)) {
      return tl::unexpected(Error(
          std::move(error)
              .about("the dual (Aᵀ, Cᵀ)")
              .hint("no output shows this mode, so nothing corrects it; measure a state that it "
                    "moves")));
    }
    return tl::unexpected(std::move(error));
  }

  const Eigen::MatrixXd& P = dual->X;
  const Eigen::MatrixXd S = C * P * C.transpose() + noise_R;
  // L = A K is the dual's gain; K itself does not need an inverse of A.
  const Eigen::MatrixXd K = detail::solve_symmetric(S, C * P).transpose();
  const Eigen::MatrixXd I_KC = Eigen::MatrixXd::Identity(n, n) - K * C;
  KalmanGain<> gain;
  gain.K = K;
  gain.L = dual->K.transpose();
  gain.P_prior = P;
  const Eigen::MatrixXd posterior = I_KC * P * I_KC.transpose() + K * noise_R * K.transpose();
  gain.P_posterior = 0.5 * (posterior + posterior.transpose());
  gain.poles = dual->poles;
  gain.residual = dual->residual;
  gain.condition = dual->condition;
  return gain;
}

}  // namespace flyball
