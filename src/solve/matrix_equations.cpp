#include <optional>

#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/exponential/matrix_function.hpp>
#include <flyball/math/riccati/riccati.hpp>

#include "core/try.hpp"
#include "solve/kernels.hpp"

// Matrix equations and functions.
namespace flyball::solve {

using Eigen::MatrixXd;

namespace {

Outcome riccati(bool continuous, ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  const MatrixXd B = problem.matrix("B");
  const MatrixXd Q = problem.matrix("Q");
  const MatrixXd R = problem.matrix("R");
  std::optional<MatrixXd> N;
  if (problem.has("N")) {
    N = problem.matrix("N");
  }
  if (!problem.status()) {
    return problem.status();
  }
  FLYBALL_TRY(const auto solution, continuous ? (N ? care(A, B, Q, R, *N) : care(A, B, Q, R))
                                              : (N ? dare(A, B, Q, R, *N) : dare(A, B, Q, R)));
  answer.add("X", solution.X);
  answer.add("K", solution.K);
  answer.add("poles", solution.poles);
  answer.add("residual", solution.residual);
  answer.add("condition", solution.condition);
  return {};
}

Outcome write_linear(const Expected<LinearMatrixSolution>& solution, AnswerWriter& answer) {
  if (!solution) {
    return tl::unexpected(solution.error());
  }
  answer.add("X", solution->X);
  answer.add("residual", solution->residual);
  answer.add("condition", solution->condition);
  return {};
}

template <auto Function>
Outcome lyapunov_kernel(ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  const MatrixXd Q = problem.matrix("Q");
  return problem.status() ? write_linear(Function(A, Q), answer) : problem.status();
}

template <auto Function>
Outcome sylvester_kernel(ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  const MatrixXd B = problem.matrix("B");
  const MatrixXd C = problem.matrix("C");
  return problem.status() ? write_linear(Function(A, B, C), answer) : problem.status();
}

Outcome write_matrix(const Expected<MatrixXd>& X, AnswerWriter& answer) {
  if (!X) {
    return tl::unexpected(X.error());
  }
  answer.add("X", *X);
  return {};
}

template <auto Function>
Outcome function_kernel(ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  return problem.status() ? write_matrix(Function(A), answer) : problem.status();
}

}  // namespace

Outcome solve_dare(ProblemReader& problem, AnswerWriter& answer) {
  return riccati(false, problem, answer);
}

Outcome solve_care(ProblemReader& problem, AnswerWriter& answer) {
  return riccati(true, problem, answer);
}

Outcome solve_lyapunov(ProblemReader& problem, AnswerWriter& answer) {
  return lyapunov_kernel<lyapunov>(problem, answer);
}

Outcome solve_discrete_lyapunov(ProblemReader& problem, AnswerWriter& answer) {
  return lyapunov_kernel<discrete_lyapunov>(problem, answer);
}

Outcome solve_sylvester(ProblemReader& problem, AnswerWriter& answer) {
  return sylvester_kernel<sylvester>(problem, answer);
}

Outcome solve_discrete_sylvester(ProblemReader& problem, AnswerWriter& answer) {
  return sylvester_kernel<discrete_sylvester>(problem, answer);
}

Outcome solve_expm(ProblemReader& problem, AnswerWriter& answer) {
  return function_kernel<expm>(problem, answer);
}

Outcome solve_logm(ProblemReader& problem, AnswerWriter& answer) {
  return function_kernel<logm>(problem, answer);
}

Outcome solve_powm(ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  const double power = problem.number("power");
  return problem.status() ? write_matrix(powm(A, power), answer) : problem.status();
}

}  // namespace flyball::solve
