#pragma once

#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/systems/model.hpp>
#include <flyball/systems/system.hpp>

namespace flyball {

namespace detail {

/// The state as output, where a model has no h.
inline constexpr auto state_as_output = [](const auto& x, const auto&) { return x; };

}  // namespace detail

/// The linear system of small deviations from a point of dx/dt = f(x, u), y = h(x, u):
///
///   A = ∂f/∂x, B = ∂f/∂u, C = ∂h/∂x, D = ∂h/∂u at (x, u),
///   d(δx)/dt = A δx + B δu,  δy = C δx + D δu,
///
/// with exact derivatives (dual numbers). It describes x - x* where (x*, u*) is an equilibrium;
/// elsewhere f(x, u) remains as a constant, which is the caller's.
///
/// @param f  f(x, u) over a generic scalar: Eigen vectors in, the n derivatives out.
/// @param h  h(x, u) likewise, p outputs. @param x  n x 1. @param u  m x 1; fixed or dynamic.
/// @return   A continuous system, of the sizes of x, u and h. @errors ArgumentError::not_finite for
///           the point, or for a derivative there, naming the matrix; wrong_shape if f(x, u) is not
///           of the size of x.
/// Cost: one call of f and of h with duals of n + m derivatives. Source: book, section 8.2.
template <class F, class H, class State, class Input>
[[nodiscard]] auto linearize(F&& f, H&& h, const Eigen::MatrixBase<State>& x,
                             const Eigen::MatrixBase<Input>& u) {
  constexpr int N = State::RowsAtCompileTime;
  constexpr int M = Input::RowsAtCompileTime;
  constexpr int P = decltype(jacobians(h, x, u).by_x)::RowsAtCompileTime;
  using System = ContinuousSystem<N, M, P>;

  if (const auto checks = Checks("linearize").finite(x, "x").finite(u, "u"); !checks) {
    return Expected<System>(tl::unexpected(checks.error()));
  }
  const auto of_f = jacobians(f, x, u);
  const auto of_h = jacobians(h, x, u);
  if (auto check = check_shape(of_f.by_x, x.size(), x.size(), "linearize", "the Jacobian of f",
                               "states x states");
      !check) {
    return Expected<System>(tl::unexpected(std::move(check).error()));
  }
  System system{of_f.by_x, of_f.by_u, of_h.by_x, of_h.by_u};
  if (auto check = check_system(system, "linearize"); !check) {
    return Expected<System>(tl::unexpected(std::move(check).error()));
  }
  return Expected<System>(std::move(system));
}

/// The same of a model: f is its derivative, h its output.
///
/// @param model  A model over a generic scalar, or one with its own `jacobians`, as AnyModel.
/// @param x  n x 1. @param u  m x 1; fixed or dynamic.
/// @return   Of the sizes of the model. @errors  As `check_model`; ArgumentError::not_finite for a
///           derivative, naming the matrix.
template <class M, class State, class Input>
  requires Model<M>
[[nodiscard]] auto linearize(M&& model, const Eigen::MatrixBase<State>& x,
                             const Eigen::MatrixBase<Input>& u) {
  using X = StateOf<M>;
  using U = InputOf<M>;
  using Y = decltype(output_of(model, std::declval<const X&>(), std::declval<const U&>()));
  using System = ContinuousSystem<X::RowsAtCompileTime, U::RowsAtCompileTime, Y::RowsAtCompileTime>;
  return check_model(model, x, u, "linearize").and_then([&]() -> Expected<System> {
    System system;
    if constexpr (requires { model.jacobians(x, u, system.A, system.B); }) {
      system.A.resize(model.states(), model.states());
      system.B.resize(model.states(), model.inputs());
      model.jacobians(x, u, system.A, system.B);
    } else {
      const auto of_f = jacobians(
          [&](const auto& at, const auto& in) { return model.derivative(at, in); }, X(x), U(u));
      system.A = of_f.by_x;
      system.B = of_f.by_u;
    }
    if constexpr (requires { model.output_jacobians(x, u, system.C, system.D); }) {
      system.C.resize(output_count(model), model.states());
      system.D.resize(output_count(model), model.inputs());
      model.output_jacobians(x, u, system.C, system.D);
    } else {
      const auto of_h = jacobians(
          [&](const auto& at, const auto& in) { return output_of(model, at, in); }, X(x), U(u));
      system.C = of_h.by_x;
      system.D = of_h.by_u;
    }
    return check_system(system, "linearize").map([&] { return std::move(system); });
  });
}

/// The same with the state as output: C = I, D = 0.
template <class F, class State, class Input>
[[nodiscard]] auto linearize(F&& f, const Eigen::MatrixBase<State>& x,
                             const Eigen::MatrixBase<Input>& u) {
  return linearize(std::forward<F>(f), detail::state_as_output, x, u);
}

/// A model that compiled code calls: f(x, u), or h(x, u), into the last argument.
using ModelFunction =
    FunctionRef<void(const Eigen::Ref<const Eigen::VectorXd>&,
                     const Eigen::Ref<const Eigen::VectorXd>&, Eigen::Ref<Eigen::VectorXd>)>;

/// The same for a black box, by differences (Richardson's unless the options say otherwise).
/// @param x  n x 1. @param u  m x 1. @return C = I, D = 0.
/// @errors DifferentiationError::not_finite; ArgumentError for the point and the step.
/// Cost: up to 20 (n + m) calls of f; allocates.
[[nodiscard]] Expected<ContinuousSystem<>> numerical_linearize(
    ModelFunction f, const Eigen::Ref<const Eigen::VectorXd>& x,
    const Eigen::Ref<const Eigen::VectorXd>& u,
    const DifferenceOptions& options = {.scheme = DifferenceScheme::richardson});

}  // namespace flyball
