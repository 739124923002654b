#include <flyball/estimation/correlated_noise.hpp>

#include <Eigen/Cholesky>

#include "core/try.hpp"

namespace flyball {

Expected<DecorrelatedPlant> decorrelate(const DiscreteSystem<>& plant, const Covariance& Q,
                                        const Covariance& R, const MatrixRef& N) {
  constexpr std::string_view where = "decorrelate";
  FLYBALL_CHECK(Q.get());
  FLYBALL_CHECK(R.get());
  FLYBALL_CHECK(check_system(plant, where));
  const Eigen::MatrixXd& of_states = *Q.get();
  const Eigen::MatrixXd& of_outputs = *R.get();
  const Eigen::Index n = plant.A.rows();
  const Eigen::Index p = plant.C.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(of_states, n, n, "Q", "states x states")
                    .shape(of_outputs, p, p, "R", "outputs x outputs")
                    .shape(N, n, p, "N", "states x outputs")
                    .finite(N, "N"));
  Eigen::MatrixXd joint(n + p, n + p);
  joint << of_states, N, N.transpose(), of_outputs;
  FLYBALL_CHECK(check_covariance(joint, where, "[Q, N; N', R]"));
  const Eigen::LLT<Eigen::MatrixXd> factor(of_outputs);
  if (factor.info() != Eigen::Success) {
    return refusal(ArgumentError::not_positive, where, "R")
        .got("singular")
        .expected("positive definite, since noises are correlated by its inverse");
  }
  const Eigen::MatrixXd K = factor.solve(N.transpose()).transpose();
  const Eigen::MatrixXd left = of_states - K * N.transpose();
  return DecorrelatedPlant{plant.A - K * plant.C, plant.B - K * plant.D, K,
                           0.5 * (left + left.transpose())};
}

}  // namespace flyball
