#pragma once

#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/core/function_ref.hpp>
#include <flyball/math/expression/tape.hpp>
#include <flyball/math/integration/butcher_tableau.hpp>
#include <flyball/optimization/problem/expression.hpp>
#include <flyball/optimization/solver/solution.hpp>

/// Optimal control problems, stated stage by stage.
namespace flyball::optimization {

/// Several expressions: the state, input, shared parameters or data that a function is given.
using ExpressionVector = Eigen::Matrix<Expression, Eigen::Dynamic, 1>;

namespace detail {

/// Calls f with as many of (x, u, p, d) as it takes.
template <class F>
[[nodiscard]] auto call_stage_function(const F& f, const ExpressionVector& x,
                                       const ExpressionVector& u, const ExpressionVector& p,
                                       const ExpressionVector& d) {
  if constexpr (std::is_invocable_v<const F&, const ExpressionVector&, const ExpressionVector&,
                                    const ExpressionVector&, const ExpressionVector&>) {
    return f(x, u, p, d);
  } else if constexpr (std::is_invocable_v<const F&, const ExpressionVector&,
                                           const ExpressionVector&, const ExpressionVector&>) {
    return f(x, u, p);
  } else if constexpr (std::is_invocable_v<const F&, const ExpressionVector&,
                                           const ExpressionVector&>) {
    return f(x, u);
  } else {
    return f(x);
  }
}

using StageFunction =
    FunctionRef<void(const ExpressionVector&, const ExpressionVector&, const ExpressionVector&,
                     const ExpressionVector&, std::vector<Expression>&)>;

struct OptimalControlData;

}  // namespace detail

/// An optimal control problem over N intervals:
///
///   minimise  Σ ℓ(x_k, u_k, p, d_k) + ℓ_N(x_N, p, d_N)   over x_0 … x_N, u_0 … u_{N-1}, p
///   subject to  x_{k+1} = f(x_k, u_k, p, d_k),  lower ≤ g(x_k, u_k, p, d_k) ≤ upper, and bounds.
///
/// p are parameters that all stages share, such as the duration where time is free; d_k are numbers
/// of a stage that may change between solves, such as a reference. Functions are generic lambdas or
/// models of the house; each is called once with expressions and recorded, then evaluated with
/// exact derivatives over all stages side by side. They may take (x), (x, u), (x, u, p) or (x, u,
/// p, d), and must not branch on values.
///
/// ```
/// OptimalControlProblem problem(2, 1, 100);
/// problem.set_derivative([](const auto& x, const auto& u) { return std::array{x(1), u(0)}; },
///                        5.0);
/// problem.set_stage_cost([](const auto& x, const auto& u) { return u(0) * u(0); });
/// problem.fix_state(0, Eigen::Vector2d(0.0, 0.0));
/// problem.fix_state(100, Eigen::Vector2d(1.0, 0.0));
/// const auto solution = solve(problem).value();
/// ```
class OptimalControlProblem {
 public:
  /// @param states, inputs  n and m. @param intervals  N. @param parameters  Entries of p.
  /// @param data  Entries of each d_k.
  /// Sizes that make no sense are refused by `solve`.
  OptimalControlProblem(int states, int inputs, int intervals, int parameters = 0, int data = 0);
  OptimalControlProblem(const OptimalControlProblem& other);
  OptimalControlProblem(OptimalControlProblem&&) noexcept;
  OptimalControlProblem& operator=(const OptimalControlProblem& other);
  OptimalControlProblem& operator=(OptimalControlProblem&&) noexcept;
  ~OptimalControlProblem();

  /// x_{k+1} = f(x_k, u_k, …). @param f  Returns n expressions: an Eigen vector, array or vector.
  template <class F>
  void set_dynamics(const F& f) {
    record_dynamics(recorder(f));
  }
  /// ẋ = f(x, u, …), over `duration` in N equal steps of an explicit Runge-Kutta method with the
  /// input held. @param f  A model or a function. @param duration  Seconds.
  template <class F>
  void set_derivative(const F& f, double duration,
                      const ButcherTableauView& method = default_method()) {
    record_derivative(recorder(f), duration, -1, method);
  }
  /// The same over a free time. @param duration  The entry of p that is the duration.
  template <class F>
  void set_derivative_over_free_time(const F& f, int duration,
                                     const ButcherTableauView& method = default_method()) {
    record_derivative(recorder(f), 0.0, duration, method);
  }
  /// The dynamics of stages first … last alone, in place of those of all: several phases.
  ///@{
  template <class F>
  void set_dynamics(const F& f, int first, int last) {
    record_dynamics_at(recorder(f), first, last);
  }
  /// @param step  Of time, s; one step of the method.
  template <class F>
  void set_derivative(const F& f, double step, int first, int last,
                      const ButcherTableauView& method = default_method()) {
    record_derivative_at(recorder(f), step, first, last, method);
  }
  template <class F>
  void set_stage_cost(const F& f, int first, int last) {
    record_cost_at(recorder(f), first, last);
  }
  ///@}
  /// ℓ at stages 0 … N-1. @param f  Returns an expression.
  template <class F>
  void set_stage_cost(const F& f) {
    record_cost(recorder(f), false);
  }
  /// ℓ_N. @param f  Of (x), or with u, which is zero there, p, d.
  template <class F>
  void set_terminal_cost(const F& f) {
    record_cost(recorder(f), true);
  }
  /// lower ≤ g ≤ upper at stages first … last (N at most), entry by entry; equal bounds are
  /// equalities, infinite ones none. @param name  For messages.
  template <class F>
  void add_constraint(const F& g, const Eigen::Ref<const Eigen::VectorXd>& lower,
                      const Eigen::Ref<const Eigen::VectorXd>& upper, int first, int last,
                      std::string name = {}) {
    record_constraint(recorder(g), lower, upper, first, last, std::move(name));
  }

  /// Bounds of all states or inputs at every stage; infinite entries are none.
  void bound_states(const Eigen::Ref<const Eigen::VectorXd>& lower,
                    const Eigen::Ref<const Eigen::VectorXd>& upper);
  void bound_inputs(const Eigen::Ref<const Eigen::VectorXd>& lower,
                    const Eigen::Ref<const Eigen::VectorXd>& upper);
  /// Of one stage alone.
  void bound_state(int stage, const Eigen::Ref<const Eigen::VectorXd>& lower,
                   const Eigen::Ref<const Eigen::VectorXd>& upper);
  void bound_input(int stage, const Eigen::Ref<const Eigen::VectorXd>& lower,
                   const Eigen::Ref<const Eigen::VectorXd>& upper);
  /// x_stage = state. NaN entries stay free.
  void fix_state(int stage, const Eigen::Ref<const Eigen::VectorXd>& state);
  void bound_parameters(const Eigen::Ref<const Eigen::VectorXd>& lower,
                        const Eigen::Ref<const Eigen::VectorXd>& upper);

  /// Where the iteration starts; what is not given is zero, within its bounds.
  /// @param states  n x (N + 1). @param inputs  m x N.
  void set_start(const Eigen::Ref<const Eigen::MatrixXd>& states,
                 const Eigen::Ref<const Eigen::MatrixXd>& inputs);
  void set_parameter_start(const Eigen::Ref<const Eigen::VectorXd>& parameters);
  /// @param data  entries x (N + 1).
  void set_data(const Eigen::Ref<const Eigen::MatrixXd>& data);

  [[nodiscard]] int states() const noexcept;
  [[nodiscard]] int inputs() const noexcept;
  [[nodiscard]] int intervals() const noexcept;
  [[nodiscard]] int parameters() const noexcept;

  /// Runge and Kutta's method of order 4.
  [[nodiscard]] static ButcherTableauView default_method() noexcept;

 private:
  friend class OptimalControlSolver;
  friend class ContinuousProblem;

  template <class F>
  [[nodiscard]] static auto recorder(const F& f) {
    return [&f](const ExpressionVector& x, const ExpressionVector& u, const ExpressionVector& p,
                const ExpressionVector& d, std::vector<Expression>& out) {
      const auto write = [&out](const auto& result) {
        if constexpr (std::is_convertible_v<decltype(result), Expression>) {
          out.push_back(result);
        } else {
          using std::size;
          for (std::size_t i = 0; i < static_cast<std::size_t>(size(result)); ++i) {
            out.push_back(entry(result, i));
          }
        }
      };
      if constexpr (requires { f.derivative(x, u); }) {
        write(f.derivative(x, u));
      } else {
        write(detail::call_stage_function(f, x, u, p, d));
      }
    };
  }
  template <class Vector>
  [[nodiscard]] static Expression entry(const Vector& v, std::size_t i) {
    if constexpr (requires { v(Eigen::Index{0}); }) {
      return v(static_cast<Eigen::Index>(i));
    } else {
      return v[i];
    }
  }

  void record_dynamics(detail::StageFunction f);
  void record_derivative(detail::StageFunction f, double duration, int free_duration,
                         const ButcherTableauView& method);
  void record_cost(detail::StageFunction f, bool terminal);
  void record_dynamics_at(detail::StageFunction f, int first, int last);
  void record_derivative_at(detail::StageFunction f, double step, int first, int last,
                            const ButcherTableauView& method);
  void record_cost_at(detail::StageFunction f, int first, int last);
  void record_constraint(detail::StageFunction f, const Eigen::Ref<const Eigen::VectorXd>& lower,
                         const Eigen::Ref<const Eigen::VectorXd>& upper, int first, int last,
                         std::string name);

  std::unique_ptr<detail::OptimalControlData> data_;
};

/// A constraint that does not hold.
struct Violation {
  std::string name{};  ///< Such as "input 0", "dynamics of state 1", or the constraint's own.
  int stage = 0;
  double amount = 0.0;  ///< By how much.
};

/// A trajectory, and what it was checked by.
struct OptimalControlSolution {
  Eigen::MatrixXd states{};      ///< n x (N + 1).
  Eigen::MatrixXd inputs{};      ///< m x N.
  Eigen::VectorXd parameters{};  ///< p.
  Eigen::MatrixXd costates{};    ///< n x N: multipliers of f(x_k, u_k) - x_{k+1} = 0.
  double cost = 0.0;
  SolveStatus status = SolveStatus::no_progress;
  double infeasibility = 0.0;    ///< max violation of dynamics and constraints.
  double optimality = 0.0;       ///< max |∂L/∂(x, u, p)|, of the objective divided by N + 1.
  double complementarity = 0.0;  ///< max product of a distance from a bound and its multiplier.
  SolverCounts counts{};
  double seconds = 0.0;                 ///< Wall time of the solve.
  std::vector<Violation> violations{};  ///< The largest first, at most ten; empty where solved.
  std::string message{};                ///< What a person should know; empty where solved.
  [[nodiscard]] bool solved() const noexcept {
    return status == SolveStatus::solved || status == SolveStatus::acceptable;
  }
};

/// Solves an optimal control problem, and again with other numbers, from what was found before.
class OptimalControlSolver {
 public:
  /// Records derivatives, compiles the stages and allocates all memory that a solve needs (but for
  /// that of a first restoration phase).
  /// @errors ArgumentError::wrong_shape, not_finite, out_of_range for what the problem states, with
  ///         the function or bound. Cost: linear in N and in the recorded operations.
  [[nodiscard]] static Expected<OptimalControlSolver> make(const OptimalControlProblem& problem);
  OptimalControlSolver(OptimalControlSolver&&) noexcept;
  OptimalControlSolver& operator=(OptimalControlSolver&&) noexcept;
  ~OptimalControlSolver();

  /// From the problem's start. The status says how it ended; the trajectory is the best found.
  /// Method: an interior-point method with a filter line search whose Newton steps are
  /// Riccati-like recursions over the stages.
  /// Cost: an iteration is O(N (n + m)³); no allocation but for the solution.
  /// Source: Wächter, Biegler (2006); Rawlings, Mayne, Diehl, "Model predictive control" (2017),
  /// section 8.8.
  [[nodiscard]] OptimalControlSolution solve(const SolverOptions& options = {});
  /// The same, `watch` looking at each step; true ends the solve.
  [[nodiscard]] OptimalControlSolution solve(const SolverOptions& options,
                                             FunctionRef<bool(const Iteration&)> watch);
  /// From the last solution and its multipliers.
  [[nodiscard]] OptimalControlSolution resolve(const SolverOptions& options = {});

  /// Other numbers for the next solve; which entries are fixed and bounded stays.
  /// @errors ArgumentError::wrong_shape, not_finite, out_of_range.
  ///@{
  Expected<void> fix_initial_state(const Eigen::Ref<const Eigen::VectorXd>& state);
  Expected<void> set_data(const Eigen::Ref<const Eigen::MatrixXd>& data);
  Expected<void> set_start(const Eigen::Ref<const Eigen::MatrixXd>& states,
                           const Eigen::Ref<const Eigen::MatrixXd>& inputs);
  ///@}

 private:
  struct Parts;
  explicit OptimalControlSolver(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

/// A problem solved once. @errors As OptimalControlSolver::make.
[[nodiscard]] Expected<OptimalControlSolution> solve(const OptimalControlProblem& problem,
                                                     const SolverOptions& options = {});

}  // namespace flyball::optimization
