#include <flyball/estimation/kalman_gain.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// Gains of observers.
namespace flyball::solve {

namespace {

Outcome solve_kalman(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto gain, kalman_gain(problem.matrix("A"), problem.matrix("C"),
                                           problem.matrix("Q"), problem.matrix("R")));
  answer.add("K", gain.K);
  answer.add("P", gain.P_prior);
  answer.add("poles", Eigen::VectorXcd(gain.poles));
  answer.add("P_posterior", gain.P_posterior);
  answer.add("L", gain.L);
  answer.add("residual", gain.residual);
  answer.add("condition", gain.condition);
  return {};
}

}  // namespace

std::vector<Kind> estimator_kinds() {
  using namespace field;
  return {
      {"kalman",
       "the steady state of a Kalman filter: P = APAᵀ + Q - APCᵀ(CPCᵀ + R)⁻¹CPAᵀ (9.6)",
       {matrix("A", "n", "n", "how the states move by themselves, sampled"),
        matrix("C", "p", "n", "how the outputs see the states"),
        matrix("Q", "n", "n", "covariance of the process noise, a sample", "state²"),
        matrix("R", "p", "p", "covariance of the measurement noise, a sample", "output²")},
       {matrix("K", "n", "p", "the filter's gain, PCᵀ(CPCᵀ + R)⁻¹ (9.22)"),
        matrix("P", "n", "n", "error covariance before an update", "state²"),
        complex_list("poles", "n", "eigenvalues of A - LC"),
        matrix("P_posterior", "n", "n", "error covariance after an update", "state²"),
        matrix("L", "n", "p", "the predictor's gain, AK"), residual, condition},
       R"({"A": [[1, 0.02], [0, 1]], "C": [[1, 0]], "Q": [[0, 0], [0, 0.01]], "R": [[0.0001]]})",
       &solve_kalman},
  };
}

}  // namespace flyball::solve
