#pragma once

#include <flyball/systems/any_model.hpp>

namespace flyball {

/// Where a model stays if nothing disturbs it.
struct ModelEquilibrium {
  Eigen::VectorXd x;             ///< n x 1, f(x, u) = 0.
  Eigen::VectorXd u;             ///< m x 1
  Eigen::VectorXd derivative{};  ///< What is left of f(x, u).
  int iterations = 0;
};

/// Which of a model's coordinates may move to find an equilibrium.
enum class EquilibriumBy {
  states,             ///< The inputs stay.
  states_and_inputs,  ///< The whole point moves as little as it takes.
};

/// An equilibrium near a point: Newton's method on f(x, u) = 0, each step the shortest that the
/// linear model asks for (least squares, so that a state that nothing depends on stays where it
/// is), halved until |f| shrinks.
///
/// @param x  n x 1, where to begin. @param u  m x 1.
/// @errors As `check_model` for the point; SearchError::no_convergence with the last point and what
///         is left of its derivative, SearchError::not_finite where the model gives no number.
/// Cost: at most 100 Jacobians and least-squares solutions; allocates.
/// Source: Nocedal and Wright, "Numerical Optimization", 2nd ed. 2006, algorithm 11.4.
[[nodiscard]] Expected<ModelEquilibrium> find_equilibrium(const AnyModel& model, const MatrixRef& x,
                                                          const MatrixRef& u,
                                                          EquilibriumBy by = EquilibriumBy::states);

/// Whether a derivative counts as zero beside the state and its Jacobians: each entry within
/// 1e-9 (1 + Σ|∂f/∂x||x| + Σ|∂f/∂u||u|).
[[nodiscard]] bool is_equilibrium(const AnyModel& model, const MatrixRef& x, const MatrixRef& u);

}  // namespace flyball
