#include <utility>

#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/exponential/matrix_function.hpp>
#include <flyball/math/riccati/riccati.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"
#include "solve/sensitivity.hpp"

// Matrix equations and functions of matrices.
namespace flyball::solve {

using Eigen::MatrixXd;

namespace {

Outcome write_riccati(Expected<RiccatiSolution> solved, JsonWriter& answer) {
  FLYBALL_TRY(const RiccatiSolution& solution, std::move(solved));
  answer.add("X", solution.X);
  answer.add("K", solution.K);
  answer.add("poles", solution.poles);
  answer.add("residual", solution.residual);
  answer.add("condition", solution.condition);
  return {};
}

Outcome solve_dare(const Problem& problem, JsonWriter& answer) {
  const MatrixXd& A = problem.matrix("A");
  const MatrixXd& B = problem.matrix("B");
  const MatrixXd& Q = problem.matrix("Q");
  const MatrixXd& R = problem.matrix("R");
  return write_riccati(problem.has("N") ? dare(A, B, Q, R, problem.matrix("N")) : dare(A, B, Q, R),
                       answer);
}

Outcome solve_care(const Problem& problem, JsonWriter& answer) {
  const MatrixXd& A = problem.matrix("A");
  const MatrixXd& B = problem.matrix("B");
  const MatrixXd& Q = problem.matrix("Q");
  const MatrixXd& R = problem.matrix("R");
  return write_riccati(problem.has("N") ? care(A, B, Q, R, problem.matrix("N")) : care(A, B, Q, R),
                       answer);
}

Outcome write_linear(Expected<LinearMatrixSolution> solved, JsonWriter& answer) {
  FLYBALL_TRY(const LinearMatrixSolution& solution, std::move(solved));
  answer.add("X", solution.X);
  answer.add("residual", solution.residual);
  answer.add("condition", solution.condition);
  return {};
}

template <auto Function>
Outcome solve_lyapunov(const Problem& problem, JsonWriter& answer) {
  return write_linear(Function(problem.matrix("A"), problem.matrix("Q")), answer);
}

template <auto Function>
Outcome solve_sylvester(const Problem& problem, JsonWriter& answer) {
  return write_linear(Function(problem.matrix("A"), problem.matrix("B"), problem.matrix("C")),
                      answer);
}

/// The X that `function` makes of A, and what A's last digits do to it.
template <class Function>
Outcome write_function(const Problem& problem, Function&& function, JsonWriter& answer) {
  const MatrixXd& A = problem.matrix("A");
  FLYBALL_TRY(const MatrixXd X, function(A));
  FLYBALL_TRY(const double error, error_of([&](int draw) {
                return function(in_its_last_digits(A, draw)).map([&](const MatrixXd& other) {
                  return relative_difference(X, other);
                });
              }));
  answer.add("X", X);
  answer.add("relative_error", error);
  return {};
}

template <auto Function>
Outcome solve_function(const Problem& problem, JsonWriter& answer) {
  return write_function(problem, Function, answer);
}

/// Of a large stiff A also the cube of e^{A/3}, whose squares round differently.
Outcome solve_expm(const Problem& problem, JsonWriter& answer) {
  const MatrixXd& A = problem.matrix("A");
  FLYBALL_TRY(const MatrixXd X, expm(A));
  FLYBALL_TRY(double error, error_of([&](int draw) {
                return expm(in_its_last_digits(A, draw)).map([&](const MatrixXd& other) {
                  return relative_difference(X, other);
                });
              }));
  if (loses_by_squares(A)) {
    FLYBALL_TRY(const MatrixXd third, expm(A / 3.0));
    error = std::max(error, relative_difference(X, MatrixXd(third * third * third)));
    FLYBALL_CHECK(check_determined(error));
  }
  answer.add("X", X);
  answer.add("relative_error", error);
  return {};
}

Outcome solve_powm(const Problem& problem, JsonWriter& answer) {
  const double power = problem.number("power");
  return write_function(problem, [power](const MatrixRef& A) { return powm(A, power); }, answer);
}

}  // namespace

std::vector<Kind> matrix_equation_kinds() {
  const std::vector<Field> riccati{field::A, field::B, field::Q, field::R, field::N};
  const std::vector<Field> riccati_answer{
      matrix("X", "n", "n", "the stabilizing solution, symmetric"),
      matrix("K", "m", "n", "the gain of u = -Kx that belongs to it"),
      complex_list("poles", "n", "eigenvalues of A - BK"), field::riccati_residual,
      field::condition};
  const std::vector<Field> lyapunov_fields{matrix("A", "n", "n", "square"),
                                           matrix("Q", "n", "n", "symmetric")};
  const std::vector<Field> sylvester_fields{matrix("A", "i", "i", "square"),
                                            matrix("B", "j", "j", "square"),
                                            matrix("C", "i", "j", "the right-hand side")};
  const std::vector<Field> linear_answer{matrix("X", "n", "n", "the solution"), field::residual,
                                         field::condition};
  const std::vector<Field> sylvester_answer{matrix("X", "i", "j", "the solution"), field::residual,
                                            field::condition};
  const std::vector<Field> square{matrix("A", "n", "n", "square")};
  const std::vector<Field> function_answer{matrix("X", "n", "n", "the function of A"),
                                           field::error};
  return {
      {"dare", "AᵀXA - X - (AᵀXB + N)(R + BᵀXB)⁻¹(BᵀXA + Nᵀ) + Q = 0 for X", riccati,
       riccati_answer,
       R"({"A": [[1, 0.1], [0, 1]], "B": [[0.005], [0.1]], "Q": [[1, 0], [0, 1]], "R": [[1]]})",
       &solve_dare},
      {"care", "AᵀX + XA - (XB + N)R⁻¹(BᵀX + Nᵀ) + Q = 0 for X (5.1)", riccati, riccati_answer,
       R"({"A": [[0, 1], [0, 0]], "B": [[0], [1]], "Q": [[1, 0], [0, 2]], "R": [[1]]})",
       &solve_care},
      {"lyapunov", "AX + XAᵀ + Q = 0 for X (5.3)", lyapunov_fields, linear_answer,
       R"({"A": [[-1, 1], [0, -2]], "Q": [[1, 0], [0, 1]]})", &solve_lyapunov<lyapunov>},
      {"discrete-lyapunov", "AXAᵀ - X + Q = 0 for X (5.4)", lyapunov_fields, linear_answer,
       R"({"A": [[0.9, 0.1], [0, 0.5]], "Q": [[1, 0], [0, 1]]})",
       &solve_lyapunov<discrete_lyapunov>},
      {"sylvester", "AX + XB = C for X", sylvester_fields, sylvester_answer,
       R"({"A": [[1, 1], [0, 2]], "B": [[3]], "C": [[4], [5]]})", &solve_sylvester<sylvester>},
      {"discrete-sylvester", "AXB - X + C = 0 for X", sylvester_fields, sylvester_answer,
       R"({"A": [[0.5, 1], [0, 0.25]], "B": [[0.5]], "C": [[3], [7]]})",
       &solve_sylvester<discrete_sylvester>},
      {"expm", "the exponential e^A", square, function_answer, R"({"A": [[0, 1], [-1, 0]]})",
       &solve_expm},
      {"logm", "the principal logarithm: e^X = A", square, function_answer,
       R"({"A": [[2, 1], [0, 2]]})", &solve_function<logm>},
      {"powm",
       "the principal power A^power",
       {square[0], number("power", "", "the exponent, any real number")},
       function_answer,
       R"({"A": [[4, 1], [0, 9]], "power": 0.5})",
       &solve_powm},
  };
}

}  // namespace flyball::solve
