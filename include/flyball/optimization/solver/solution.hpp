#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

/// How a minimisation is to end, and how it ended.
namespace flyball::optimization {

/// When to stop.
struct SolverOptions {
  double tolerance = 1e-8;     ///< Of the scaled first-order conditions.
  int max_iterations = 1000;   ///< Steps.
  double time_limit = 1e9;     ///< Seconds of wall time; looked at between two steps.
  double first_barrier = 0.0;  ///< μ at the start; 0: chosen.
  /// By how much the regularisation of a Hessian that is indefinite grows, until it is no longer;
  /// > 1.
  double regularization_growth = 4.0;
};

/// How a minimisation ended.
enum class SolveStatus : std::uint8_t {
  solved,           ///< The first-order conditions hold within the tolerance.
  acceptable,       ///< No step improves on what holds within 1e3 times the tolerance.
  infeasible,       ///< The violation of the constraints is at a minimum that is not zero.
  unbounded,        ///< The objective falls without end.
  iteration_limit,  ///< The cap of the options.
  time_limit,       ///< The options' seconds are over.
  stopped,          ///< The callback wanted it.
  no_progress,      ///< No step is accepted, by rounding or since a function is not smooth.
  not_finite,       ///< A function is NaN or infinite wherever a step could lead.
};
[[nodiscard]] std::string_view to_string(SolveStatus status);

/// A row of the iteration table.
struct Iteration {
  int number = 0;
  double cost = 0.0;             ///< f, scaled as the solver has it.
  double infeasibility = 0.0;    ///< max |c|.
  double optimality = 0.0;       ///< max |∇f + Aᵀλ - z|.
  double complementarity = 0.0;  ///< max |s z - μ|.
  double barrier = 0.0;          ///< μ.
  double regularization = 0.0;   ///< What was added to the Hessian.
  double step = 0.0;             ///< Share of the primal step taken.
  double dual_step = 0.0;        ///< Of the dual one.
  int trials = 0;                ///< Points tried by the line search.
  bool restoration = false;      ///< Whether it was a step that restores feasibility.
};

/// What a solve cost.
struct SolverCounts {
  int iterations = 0;
  int restorations = 0;  ///< Times that the restoration phase was entered.
  int factorizations = 0;
  int evaluations = 0;  ///< Of the functions without derivatives.
  int corrections = 0;  ///< Second-order corrections that were taken.
};

}  // namespace flyball::optimization
