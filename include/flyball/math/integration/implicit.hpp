#pragma once

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/math/integration/butcher_tableau.hpp>

/// Single steps of implicit Runge-Kutta methods, of a length of one's own choice.
namespace flyball {

/// The compiled core of `implicit_runge_kutta_step`.
/// @param jacobian  Or null: by differences. @errors As `implicit_runge_kutta_step`.
[[nodiscard]] Expected<Eigen::VectorXd> implicit_step(const ButcherTableauView& tableau,
                                                      OdeFunction f, const OdeJacobian* jacobian,
                                                      double t,
                                                      const Eigen::Ref<const Eigen::VectorXd>& x,
                                                      double dt);

/// One step of any Runge-Kutta method, such as tableaus::gauss_legendre_4 (which keeps the energy
/// of a mechanism without friction) or tableaus::backward_euler, from x at t to x at t + dt.
///
/// The stages are found by a simplified Newton iteration on
/// z_i = dt Σ_j a_ij f(t + c_j dt, x + z_j) with the Jacobian at (t, x), to rounding.
///
/// @param f  f(t, x); a member `jacobian(t, x)` is taken as in `integrate`.
/// @param t  s. @param x  n x 1. @param dt  s; may be negative.
/// @errors IntegrationError::no_convergence: the step is too long for this Jacobian; not_finite;
///         ArgumentError for t, x and dt that are not finite, or an empty x.
/// Cost: about ten calls of f a stage and as many solutions of order n · stages; allocates.
/// Source: Hairer, Wanner, "Solving Ordinary Differential Equations II", IV.8.
template <class F, class Derived>
[[nodiscard]] Expected<Eigen::Matrix<double, Derived::RowsAtCompileTime, 1>>
implicit_runge_kutta_step(const ButcherTableauView& tableau, const F& f, double t,
                          const Eigen::MatrixBase<Derived>& x, double dt) {
  using State = Eigen::Matrix<double, Derived::RowsAtCompileTime, 1>;
  using Ref = Eigen::Ref<const Eigen::VectorXd>;
  const auto sized = [](const Eigen::VectorXd& next) { return State(next); };
  const auto derivative = [&f](double time, const Ref& at, Eigen::Ref<Eigen::VectorXd> dxdt) {
    dxdt = f(time, State(at));
  };
  if constexpr (requires(const State& at) { f.jacobian(t, at); }) {
    const auto jacobian = [&f](double time, const Ref& at, Eigen::Ref<Eigen::MatrixXd> J) {
      J = f.jacobian(time, State(at));
    };
    const OdeJacobian reference(jacobian);
    return implicit_step(tableau, derivative, &reference, t, State(x), dt).map(sized);
  } else {
    return implicit_step(tableau, derivative, nullptr, t, State(x), dt).map(sized);
  }
}

}  // namespace flyball
