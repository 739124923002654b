#pragma once

#include <concepts>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/coordinate.hpp>

/// What everything that simulates, linearises, estimates and plans takes: a model, written once.
///
/// A model is a type with its sizes and its derivative over a generic scalar:
///
/// ```
/// struct Pendulum {
///   double length = 0.5;
///   static constexpr int states() { return 2; }
///   static constexpr int inputs() { return 1; }
///   template <class X, class U>
///   auto derivative(const X& x, const U& u) const {
///     return Eigen::Vector<ScalarOf<X, U>, 2>{x(1), -9.81 / length * sin(x(0)) + u(0)};
///   }
/// };
/// ```
///
/// and, where it has them,
///
/// - `output(x, u)`, and `outputs()` if the size of the result is not known at compile time;
/// without
///   it the output is the state,
/// - `derivative(x, u, p)` and `parameters()`, the formula over its parameters and the vector of
///   their values (and `output(x, u, p)` if the output depends on them): then `derivative(x, u)` is
///   the line `return derivative(x, u, parameters());`, and fits and optimal control differentiate
///   with respect to p,
/// - `description()`, a ModelDescription: names, units, which coordinates are angles,
/// - `jacobians(x, u, A, B)` and `output_jacobians(x, u, C, D)`, which write exact derivatives that
///   it knows better than dual numbers do; of a model with parameters `jacobians(x, u, p, A, B)`
///   and `output_jacobians(x, u, p, C, D)`.
///
/// `states()` and `inputs()` of a model whose size is known at run time only are ordinary members.
/// A ContinuousSystem is a model, and so are the mechanisms and `AnyModel`, which holds any of
/// them.
namespace flyball {

/// A constant of a model.
struct Parameter {
  std::string name{};
  std::string unit{};  ///< SI; empty where it has none.
  double value = 0.0;
};

/// What a model's numbers are.
struct ModelDescription {
  std::string name{};  ///< Such as "pendulum".
  std::vector<Coordinate> states{};
  std::vector<Coordinate> inputs{};
  std::vector<Coordinate> outputs{};
  std::vector<Parameter> parameters{};  ///< In the order of `parameters()`.
};

/// The scalar of a formula in several Eigen vectors: that of the one that carries derivatives.
template <class... Vectors>
using ScalarOf = std::common_type_t<typename std::remove_cvref_t<Vectors>::Scalar...>;

namespace detail {

template <class M>
[[nodiscard]] consteval int fixed_states() {
  if constexpr (requires { std::integral_constant<int, std::remove_cvref_t<M>::states()>{}; }) {
    return std::remove_cvref_t<M>::states();
  } else {
    return Eigen::Dynamic;
  }
}

template <class M>
[[nodiscard]] consteval int fixed_inputs() {
  if constexpr (requires { std::integral_constant<int, std::remove_cvref_t<M>::inputs()>{}; }) {
    return std::remove_cvref_t<M>::inputs();
  } else {
    return Eigen::Dynamic;
  }
}

}  // namespace detail

/// A model's state: n x 1, sized at compile time where the model is.
template <class M, class Scalar = double>
using StateOf = Eigen::Matrix<Scalar, detail::fixed_states<M>(), 1>;
/// A model's input, m x 1.
template <class M, class Scalar = double>
using InputOf = Eigen::Matrix<Scalar, detail::fixed_inputs<M>(), 1>;

/// A model, as the head of this file says.
template <class M>
concept Model =
    requires(const std::remove_cvref_t<M>& model, const StateOf<M>& x, const InputOf<M>& u) {
      { model.states() } -> std::convertible_to<Eigen::Index>;
      { model.inputs() } -> std::convertible_to<Eigen::Index>;
      { model.derivative(x, u).size() } -> std::convertible_to<Eigen::Index>;
    };

/// A model that says what it measures.
template <class M>
concept ModelWithOutput =
    Model<M> && requires(const std::remove_cvref_t<M>& model, const StateOf<M>& x,
                         const InputOf<M>& u) { model.output(x, u).size(); };

/// A model whose formula takes its parameters.
template <class M>
concept ParametricModel = Model<M> && requires(const std::remove_cvref_t<M>& model,
                                               const StateOf<M>& x, const InputOf<M>& u) {
  model.derivative(x, u, model.parameters()).size();
};

/// y = h(x, u), or the state of a model that has no h. @param x  n x 1. @param u  m x 1.
template <Model M, class State, class Input>
[[nodiscard]] auto output_of(const M& model, const State& x, const Input& u) {
  if constexpr (ModelWithOutput<M>) {
    return model.output(x, u).eval();
  } else {
    return x.eval();
  }
}
/// The same for given parameters.
template <Model M, class State, class Input, class Parameters>
[[nodiscard]] auto output_of(const M& model, const State& x, const Input& u, const Parameters& p) {
  if constexpr (requires { model.output(x, u, p); }) {
    return model.output(x, u, p).eval();
  } else {
    return output_of(model, x, u);
  }
}

/// The number of outputs, p.
template <Model M>
[[nodiscard]] constexpr Eigen::Index output_count(const M& model) {
  if constexpr (!ModelWithOutput<M>) {
    return model.states();
  } else if constexpr (requires { model.outputs(); }) {
    return model.outputs();
  } else {
    constexpr int size = decltype(model.output(
        std::declval<const StateOf<M>&>(), std::declval<const InputOf<M>&>()))::SizeAtCompileTime;
    static_assert(size != Eigen::Dynamic, "a model whose output has no fixed size needs outputs()");
    return size;
  }
}

namespace detail {

/// Names that are missing are x1, u1, y1, p1 and so on; outputs of a model without are its states.
[[nodiscard]] ModelDescription completed(ModelDescription description, Eigen::Index states,
                                         Eigen::Index inputs, Eigen::Index outputs, bool has_output,
                                         const MatrixRef& parameters);

/// The checks of `check_model` on what it was called with, and on what the model answered.
[[nodiscard]] Expected<void> check_point(const ModelDescription& description, const MatrixRef& x,
                                         const MatrixRef& u, std::string_view where, double t);
[[nodiscard]] Expected<void> check_answer(std::string_view what,
                                          const std::vector<Coordinate>& coordinates,
                                          const MatrixRef& answer, const MatrixRef& x,
                                          const MatrixRef& u, std::string_view where, double t);

}  // namespace detail

/// A model's description, complete: as many names as it has states, inputs, outputs and parameters.
/// Names that it does not give are x1, x2, …, u1, …, y1, …, p1, …; a model whose formula does not
/// take parameters has none. Allocates.
template <Model M>
[[nodiscard]] ModelDescription describe(const M& model) {
  ModelDescription description;
  if constexpr (requires { model.description(); }) {
    description = model.description();
  }
  Eigen::VectorXd parameters(0);
  if constexpr (requires { model.parameters(); }) {
    parameters = model.parameters();
  }
  return detail::completed(std::move(description), model.states(), model.inputs(),
                           output_count(model), ModelWithOutput<M>, parameters);
}

/// The check where a model enters: x and u have its sizes and are finite, and so are its derivative
/// and its output there.
///
/// @param x  n x 1. @param u  m x 1. @param where  The function that asks, for the message.
/// @param t  s, the time at which it is asked, for the message.
/// @errors ArgumentError::wrong_shape for x, u, a derivative or an output of another size;
///         not_finite, naming the coordinate, with t, x and u as evidence.
/// Cost: one call of the derivative and of the output; allocates.
template <Model M, class State, class Input>
[[nodiscard]] Expected<void> check_model(const M& model, const Eigen::MatrixBase<State>& x,
                                         const Eigen::MatrixBase<Input>& u, std::string_view where,
                                         double t = 0.0) {
  if constexpr (requires { model.check(x, u, where, t); }) {
    return model.check(x, u, where, t);
  } else {
    const ModelDescription description = describe(model);
    return Checks(where)
        .also([&] { return detail::check_point(description, x, u, where, t); })
        .also([&] {
          const Eigen::MatrixXd dxdt = model.derivative(StateOf<M>(x), InputOf<M>(u));
          return detail::check_answer("derivative", description.states, dxdt, x, u, where, t);
        })
        .also([&] {
          const Eigen::MatrixXd y = output_of(model, StateOf<M>(x), InputOf<M>(u));
          return detail::check_answer("output", description.outputs, y, x, u, where, t);
        });
  }
}

/// a - b in [-π, π], the way round that is shorter; rad, over a generic scalar.
template <class Scalar>
[[nodiscard]] Scalar angle_difference(const Scalar& a, const Scalar& b) noexcept {
  using std::remainder;
  return remainder(Scalar(a - b), Scalar(2.0 * std::numbers::pi));
}

/// A difference of two states (or outputs) where the angles go the shorter way round: those entries
/// are brought into [-π, π]. @param difference  n x 1. @param coordinates  n of them.
template <class Derived>
void wrap_angles(Eigen::MatrixBase<Derived>& difference, std::span<const Coordinate> coordinates) {
  using Scalar = typename Derived::Scalar;
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    if (coordinates[i].is_angle) {
      auto& entry = difference(static_cast<Eigen::Index>(i));
      entry = angle_difference(Scalar(entry), Scalar(0.0));
    }
  }
}

}  // namespace flyball
