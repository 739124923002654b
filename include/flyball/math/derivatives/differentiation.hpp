#pragma once

#include <utility>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/core/function_ref.hpp>
#include <flyball/math/derivatives/dual.hpp>

/// Exact derivatives of functions written over a generic scalar, and differences for those that are
/// not. A function over a generic scalar takes an Eigen vector of any scalar:
///
/// ```
/// const auto f = [](const auto& x, const auto& u) {
///   using Scalar = typename std::decay_t<decltype(x)>::Scalar;
///   return Eigen::Vector<Scalar, 2>{x(1), -9.81 * sin(x(0)) + u(0)};
/// };
/// ```
namespace flyball {

/// Why there is no derivative.
enum class DifferentiationError {
  not_finite,  ///< The function gave NaN or infinity at a point that the differences need.
};
[[nodiscard]] ErrorInfo error_info(DifferentiationError code);

namespace detail {

constexpr int sum_of_sizes(int a, int b) {
  return a == Eigen::Dynamic || b == Eigen::Dynamic ? Eigen::Dynamic : a + b;
}

/// The entries of x as variables number `first` and up, out of `variables`.
template <int N, int Order, class Derived>
[[nodiscard]] auto as_variables(const Eigen::MatrixBase<Derived>& x, Eigen::Index first,
                                Eigen::Index variables) {
  Eigen::Matrix<Dual<N, Order>, Derived::RowsAtCompileTime, 1> duals(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    duals(i) = Dual<N, Order>::variable(x(i), first + i, variables);
  }
  return duals;
}

/// The rows of gradients below each other.
template <class Derived>
[[nodiscard]] auto stacked_gradients(const Eigen::MatrixBase<Derived>& y, Eigen::Index variables) {
  using Scalar = typename Derived::Scalar;
  Eigen::Matrix<double, Derived::RowsAtCompileTime, Scalar::Gradient::RowsAtCompileTime> J(
      y.size(), variables);
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    if (y(i).gradient.size() == 0) {
      J.row(i).setZero();
    } else {
      J.row(i) = y(i).gradient.transpose();
    }
  }
  return J;
}

}  // namespace detail

/// ∂f/∂x of a vector function, exact but for rounding.
/// @param f  f(x) over a generic scalar, a vector of m entries. @param x  n x 1.
/// @return m x n, sized at compile time where f(x) and x are. Cost: one call of f with duals of n
/// derivatives; no allocation for fixed sizes. Source: book, section 5.12.1.
template <class F, class Derived>
[[nodiscard]] auto jacobian(F&& f, const Eigen::MatrixBase<Derived>& x) {
  const auto y = f(detail::as_variables<Derived::RowsAtCompileTime, 1>(x, 0, x.size())).eval();
  return detail::stacked_gradients(y, x.size());
}

/// ∂f/∂x and ∂f/∂u of f(x, u).
template <class A, class B>
struct JacobianPair {
  A by_x;  ///< m x n
  B by_u;  ///< m x inputs
};

/// Both Jacobians of f(x, u) in one call, exact but for rounding. @param x  n x 1. @param u  the
/// inputs x 1. Cost: as `jacobian` with n + inputs derivatives.
template <class F, class State, class Input>
[[nodiscard]] auto jacobians(F&& f, const Eigen::MatrixBase<State>& x,
                             const Eigen::MatrixBase<Input>& u) {
  constexpr int N = detail::sum_of_sizes(State::RowsAtCompileTime, Input::RowsAtCompileTime);
  const Eigen::Index variables = x.size() + u.size();
  const auto y = f(detail::as_variables<N, 1>(x, 0, variables),
                   detail::as_variables<N, 1>(u, x.size(), variables))
                     .eval();
  const auto J = detail::stacked_gradients(y, variables);
  using A = Eigen::Matrix<double, decltype(J)::RowsAtCompileTime, State::RowsAtCompileTime>;
  using B = Eigen::Matrix<double, decltype(J)::RowsAtCompileTime, Input::RowsAtCompileTime>;
  return JacobianPair<A, B>{J.leftCols(x.size()), J.rightCols(u.size())};
}

/// The gradient of a number f(x), exact but for rounding. @param x  n x 1. @return n x 1.
template <class F, class Derived>
[[nodiscard]] auto gradient(F&& f, const Eigen::MatrixBase<Derived>& x) {
  constexpr int N = Derived::RowsAtCompileTime;
  const Dual<N> y = f(detail::as_variables<N, 1>(x, 0, x.size()));
  using Gradient = typename Dual<N>::Gradient;
  return y.gradient.size() == 0 ? Gradient(Gradient::Zero(x.size())) : y.gradient;
}

/// A number's value, gradient and Hessian.
template <int N>
struct SecondOrder {
  double value = 0.0;
  Eigen::Matrix<double, N, 1> gradient;  ///< n x 1
  Eigen::Matrix<double, N, N> hessian;   ///< n x n, symmetric.
};

/// The Hessian (and gradient and value) of a number f(x), exact but for rounding. @param x  n x 1.
/// Cost: one call of f with hyper-dual numbers: n² products an operation.
template <class F, class Derived>
[[nodiscard]] auto hessian(F&& f, const Eigen::MatrixBase<Derived>& x) {
  constexpr int N = Derived::RowsAtCompileTime;
  const Dual<N, 2> y = f(detail::as_variables<N, 2>(x, 0, x.size()));
  using Gradient = typename Dual<N, 2>::Gradient;
  using Hessian = typename Dual<N, 2>::Hessian;
  return y.gradient.size() == 0
             ? SecondOrder<N>{y.value, Gradient::Zero(x.size()), Hessian::Zero(x.size(), x.size())}
             : SecondOrder<N>{y.value, y.gradient, y.hessian};
}

/// A system f(t, x) together with its exact Jacobian, for `integrate`.
template <class F>
struct WithExactJacobian {
  F function;
  template <class State>
  [[nodiscard]] auto operator()(double t, const State& x) const {
    return function(t, x);
  }
  template <class State>
  [[nodiscard]] auto jacobian(double t, const State& x) const {
    return flyball::jacobian([&](const auto& at) { return function(t, at); }, x);
  }
};

/// f(t, x), written over a generic scalar, for `integrate`: where the system is stiff, ∂f/∂x is
/// exact and costs one call.
template <class F>
[[nodiscard]] WithExactJacobian<F> with_exact_jacobian(F f) {
  return {std::move(f)};
}

/// How to difference.
enum class DifferenceScheme {
  central,     ///< (f(x + h) - f(x - h))/2h: error O(h²).
  richardson,  ///< Central ones of shrinking steps extrapolated to zero (Ridders): near full
               ///< precision where f is smooth, at up to ten times the cost.
};

/// Options of the differences.
struct DifferenceOptions {
  DifferenceScheme scheme = DifferenceScheme::central;
  /// Step of each variable in its unit; 0: ε^(1/3) max(1, |x|) for central ones, and
  /// 0.1 max(1, |x|) to begin with for Richardson's.
  double step = 0.0;
};

/// A vector function as compiled code sees it: f(x) into the last argument.
using VectorFunction =
    FunctionRef<void(const Eigen::Ref<const Eigen::VectorXd>&, Eigen::Ref<Eigen::VectorXd>)>;
/// A number f(x) as compiled code sees it.
using ScalarFunction = FunctionRef<double(const Eigen::Ref<const Eigen::VectorXd>&)>;

/// ∂f/∂x of a black box by differences.
/// @param f  m numbers from n. @param x  n x 1. @param outputs  m.
/// @return m x n. @errors DifferentiationError::not_finite with the variable and the point;
/// ArgumentError for x or a step that is not finite, or negative. Cost: 2 n calls (central), up to
/// 20 n (Richardson); allocates. Source: Ridders, "Accurate computation of F'(x) and F'(x) F''(x)",
/// Adv. Eng. Software 4 (1982).
[[nodiscard]] Expected<Eigen::MatrixXd> numerical_jacobian(
    VectorFunction f, const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Index outputs,
    const DifferenceOptions& options = {});

/// The gradient of a black box by differences. @return n x 1. @errors, cost as
/// `numerical_jacobian`.
[[nodiscard]] Expected<Eigen::VectorXd> numerical_gradient(
    ScalarFunction f, const Eigen::Ref<const Eigen::VectorXd>& x,
    const DifferenceOptions& options = {});

/// The Hessian of a black box by central differences of the second order.
/// @param step  In each variable's unit; 0: ε^(1/4) max(1, |x|). @return n x n, symmetric.
/// @errors as `numerical_jacobian`. Cost: 2 n² + 1 calls. Error: O(step²), at best about 1e-8.
[[nodiscard]] Expected<Eigen::MatrixXd> numerical_hessian(
    ScalarFunction f, const Eigen::Ref<const Eigen::VectorXd>& x, double step = 0.0);

}  // namespace flyball
