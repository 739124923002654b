#include <utility>

#include <flyball/control/pole_placement.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"
#include "solve/kernels.hpp"

// Designs: gains of controllers and observers.
namespace flyball::solve {

using Eigen::MatrixXd;

/// A and B are continuous: with T the plant is sampled and the weights are the discrete cost's, as
/// in Theorem 7.7.1; "domain": "discrete" says that A and B are sampled already.
Outcome solve_lqr(ProblemReader& problem, AnswerWriter& answer) {
  MatrixXd A = problem.matrix("A");
  MatrixXd B = problem.matrix("B");
  const MatrixXd Q = problem.matrix("Q");
  const MatrixXd R = problem.matrix("R");
  const MatrixXd N = problem.matrix_or_zero("N", A.rows(), B.cols());
  bool discrete = false;
  if (problem.has("domain")) {
    discrete = problem.domain() == TimeDomain::discrete;
  }
  if (!problem.status()) {
    return problem.status();
  }
  if (problem.has("T") && !discrete) {
    const double period = problem.number("T");
    if (!problem.status()) {
      return problem.status();
    }
    FLYBALL_TRY(auto sampled, discretize_zoh(A, B, Time(period)));
    A = std::move(sampled.A);
    B = std::move(sampled.B);
    discrete = true;
  }
  const auto solution = discrete ? dare(A, B, Q, R, N) : care(A, B, Q, R, N);
  if (!solution) {
    return tl::unexpected(Error(solution.error()).in("lqr"));
  }
  answer.add("K", solution->K);
  answer.add("S", solution->X);
  answer.add("poles", solution->poles);
  answer.add("residual", solution->residual);
  answer.add("condition", solution->condition);
  return {};
}

Outcome solve_place(ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  const MatrixXd B = problem.matrix("B");
  const Eigen::VectorXcd poles = problem.complex_list("poles");
  if (!problem.status()) {
    return problem.status();
  }
  FLYBALL_TRY(const auto placed, place(A, B, poles));
  answer.add("K", placed.K);
  answer.add("poles", Eigen::VectorXcd(placed.poles));
  answer.add("condition", placed.condition);
  return {};
}

Outcome solve_kalman(ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  const MatrixXd C = problem.matrix("C");
  const MatrixXd Q = problem.matrix("Q");
  const MatrixXd R = problem.matrix("R");
  if (!problem.status()) {
    return problem.status();
  }
  FLYBALL_TRY(const auto gain, kalman_gain(A, C, Q, R));
  answer.add("K", gain.K);
  answer.add("P", gain.P_prior);
  answer.add("poles", Eigen::VectorXcd(gain.poles));
  answer.add("P_posterior", gain.P_posterior);
  answer.add("L", gain.L);
  answer.add("residual", gain.residual);
  answer.add("condition", gain.condition);
  return {};
}

}  // namespace flyball::solve
