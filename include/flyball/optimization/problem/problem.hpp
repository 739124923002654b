#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/core/function_ref.hpp>
#include <flyball/optimization/problem/expression.hpp>
#include <flyball/optimization/problem/expression_matrix.hpp>
#include <flyball/optimization/solver/solution.hpp>

namespace flyball::optimization {

/// Why a problem cannot be posed to a solver.
enum class ProblemError {
  no_variables,   ///< Nothing to decide.
  wrong_shape,    ///< A slice beyond its matrix, or matrices that do not fit.
  other_problem,  ///< An expression of another problem.
  not_finite,     ///< A number in it is NaN or infinite.
};
[[nodiscard]] ErrorInfo error_info(ProblemError code);

/// A constraint that does not hold.
struct ConstraintViolation {
  std::size_t constraint = 0;  ///< In the order of `subject_to`, entry by entry.
  std::string name{};   ///< As `subject_to` was told, with the entry's number; or "constraint 3".
  double amount = 0.0;  ///< By how much.
};

/// How a problem was solved. The values are read from the variables.
struct ProblemSolution {
  SolveStatus status = SolveStatus::no_progress;
  double cost = 0.0;           ///< What was minimised or maximised.
  double infeasibility = 0.0;  ///< Largest violation of a constraint.
  double optimality = 0.0;     ///< Of the first-order conditions, scaled.
  double complementarity = 0.0;
  Degree cost_degree = Degree::constant;
  Degree equality_degree = Degree::constant;
  Degree inequality_degree = Degree::constant;
  std::string method{};           ///< Such as "quadratic program, Mehrotra's predictor-corrector".
  Eigen::VectorXd multipliers{};  ///< One a constraint: of c = 0, and of c ≥ 0 (then >= 0).
  /// Where infeasible: weights of the constraints whose combination no point satisfies; where
  /// unbounded: a direction in which the cost falls for ever. Linear and quadratic programs only.
  Eigen::VectorXd certificate{};
  SolverCounts counts{};
  double seconds = 0.0;
  std::vector<Iteration> iterations{};
  std::vector<ConstraintViolation> violations{};  ///< The largest first, at most ten.
  std::string message{};                          ///< Empty where solved.
  [[nodiscard]] bool solved() const noexcept {
    return status == SolveStatus::solved || status == SolveStatus::acceptable;
  }
};

/// A constrained optimisation problem in mathematical notation (section 17.1).
///
/// ```
/// Problem problem;
/// const auto X = problem.decision_variable(2, N + 1);
/// const auto U = problem.decision_variable(1, N);
/// for (int k = 0; k < N; ++k) {
///   problem.subject_to(X(0, k + 1) == X(0, k) + X(1, k) * dt);
///   problem.subject_to(X(1, k + 1) == X(1, k) + U(0, k) * dt);
/// }
/// problem.subject_to(-1.0 <= U);
/// Expression J = 0.0;
/// for (int k = 0; k <= N; ++k) {
///   J += pow(r - X(0, k), 2);
/// }
/// problem.minimize(J);
/// problem.solve();
/// X.value(0, 10);
/// ```
///
/// Expressions refer to their problem, which stays where it is when the object is moved.
class Problem {
 public:
  Problem();
  Problem(Problem&&) noexcept;
  Problem& operator=(Problem&&) noexcept;
  ~Problem();

  /// A variable that the solver chooses; it starts at 0, or where `set_value` puts it.
  [[nodiscard]] Expression decision_variable();
  /// A matrix of them. A size that is not positive gives an empty matrix.
  [[nodiscard]] ExpressionMatrix decision_variable(Eigen::Index rows, Eigen::Index columns = 1);
  /// A number that may change between solves (`set_value`); constraints and costs follow it.
  [[nodiscard]] Expression parameter(double value);
  [[nodiscard]] ExpressionMatrix parameter(const Eigen::Ref<const Eigen::MatrixXd>& values);

  /// The cost; the last call counts. Without one any point that satisfies the constraints will do.
  void minimize(const Expression& cost);
  void maximize(const Expression& gain);
  /// Constraints that have to hold. @param name  For messages.
  void subject_to(const Constraints& constraints, std::string_view name = {});

  /// Finds a local minimum, and leaves it in the variables, the best point found where the status
  /// is not `solved`. What the expressions' degrees allow is used: linear and convex quadratic
  /// programs by Mehrotra's predictor-corrector method, all else by a filter interior-point method;
  /// problems along stages by recursion over these. Solved again, it starts where it ended.
  /// |e|, √(e²), max(a, b) and min(a, b) in sums that are minimised or bounded are solved as
  /// variables t with t ≥ ±e, t ≥ a and b, or t ≤ a and b.
  /// @errors ProblemError, with the constraint.
  /// Source: book, section 17.1.2; Mehrotra, "On the implementation of a primal-dual interior point
  /// method" (1992); Wächter, Biegler (2006).
  Expected<ProblemSolution> solve(const SolverOptions& options = {});
  /// The same, `watch` looking at each step; true ends the solve.
  Expected<ProblemSolution> solve(const SolverOptions& options,
                                  FunctionRef<bool(const Iteration&)> watch);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace flyball::optimization
