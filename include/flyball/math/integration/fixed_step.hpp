#pragma once

#include <array>
#include <cstddef>
#include <utility>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/math/integration/butcher_tableau.hpp>

/// Numerical integration with fixed steps, for the control loop: templates that allocate nothing
/// for states of fixed size. Integration to an accuracy is in integration_adaptive.hpp.
namespace flyball {

/// One step of an explicit Runge-Kutta method: x at t to x at t + dt.
///
/// @param tableau  An explicit one, such as tableaus::rk4. @param f  dx/dt = f(t, x), a vector (or
/// a
///                 number) of the shape of x; called `stages` times.
/// @param t  s. @param x  State: an Eigen vector, or double. @param dt  Step, s; may be negative.
/// Cost: no allocation for fixed sizes. Source: book, section 7.9.1.
template <std::size_t Stages, class F, class State>
[[nodiscard]] State runge_kutta_step(const ButcherTableau<Stages>& tableau, F&& f, double t,
                                     const State& x, double dt) {
  std::array<State, Stages> k;
  for (std::size_t i = 0; i < Stages; ++i) {
    State stage = x;
    for (std::size_t j = 0; j < i; ++j) {
      if (tableau.A[i][j] != 0.0) {
        stage += (dt * tableau.A[i][j]) * k[j];
      }
    }
    k[i] = f(t + tableau.c[i] * dt, std::as_const(stage));
  }
  State next = x;
  for (std::size_t i = 0; i < Stages; ++i) {
    if (tableau.b[i] != 0.0) {
      next += (dt * tableau.b[i]) * k[i];
    }
  }
  return next;
}

/// One step of dx/dt = f(x), f(x, u) or f(t, x, u), the input held constant over the step.
/// @param dt  Step, s. Cost: one call of f; no allocation for fixed sizes. Error: O(dt) over a
/// fixed time. Source: book, Theorem 7.9.1.
template <class F, class State>
[[nodiscard]] State forward_euler(F&& f, const State& x, double dt) {
  return runge_kutta_step(
      tableaus::forward_euler, [&](double, const State& at) { return State(f(at)); }, 0.0, x, dt);
}
template <class F, class State, class Input>
[[nodiscard]] State forward_euler(F&& f, const State& x, const Input& u, double dt) {
  return forward_euler([&](const State& at) { return State(f(at, u)); }, x, dt);
}
template <class F, class State, class Input>
[[nodiscard]] State forward_euler(F&& f, double t, const State& x, const Input& u, double dt) {
  return forward_euler([&](const State& at) { return State(f(t, at, u)); }, x, dt);
}

/// One step of the classical Runge-Kutta method for dx/dt = f(x), f(x, u) or f(t, x, u), the input
/// held constant over the step.
/// @param dt  Step, s. Cost: four calls of f; no allocation for fixed sizes. Error: O(dt⁴) over a
/// fixed time. Source: book, Theorem 7.9.2, Snippet 7.1.
template <class F, class State>
[[nodiscard]] State rk4(F&& f, const State& x, double dt) {
  const double half = 0.5 * dt;
  const State k1 = f(x);
  const State k2 = f(State(x + half * k1));
  const State k3 = f(State(x + half * k2));
  const State k4 = f(State(x + dt * k3));
  return x + (dt / 6.0) * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
}
template <class F, class State, class Input>
[[nodiscard]] State rk4(F&& f, const State& x, const Input& u, double dt) {
  return rk4([&](const State& at) { return State(f(at, u)); }, x, dt);
}
template <class F, class State, class Input>
[[nodiscard]] State rk4(F&& f, double t, const State& x, const Input& u, double dt) {
  return runge_kutta_step(
      tableaus::rk4, [&](double time, const State& at) { return State(f(time, at, u)); }, t, x, dt);
}

/// x(t + dt) of dx/dt = A x + B u with u constant, exact but for rounding, from the exponential of
/// [A B; 0 0] dt.
///
/// @param A  n x n. @param B  n x m. @param x  n. @param u  m. @param dt  s; may be negative.
/// @return n. @errors ArgumentError for shapes and entries; MatrixExponentialError::overflow.
/// Cost: one exponential of order n + 1; allocates. For many steps of one length take
/// `discretize_zoh`. Source: book, section 7.3.
[[nodiscard]] Expected<Eigen::VectorXd> integrate_linear(const MatrixRef& A, const MatrixRef& B,
                                                         const MatrixRef& x, const MatrixRef& u,
                                                         double dt);

/// The same for an input that goes from u to u_next along a straight line (first-order hold).
/// @param u_next  m, the input at t + dt. Cost: one exponential of order n + 2.
[[nodiscard]] Expected<Eigen::VectorXd> integrate_linear(const MatrixRef& A, const MatrixRef& B,
                                                         const MatrixRef& x, const MatrixRef& u,
                                                         const MatrixRef& u_next, double dt);

}  // namespace flyball
