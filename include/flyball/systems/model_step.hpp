#pragma once

#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/math/integration/fixed_step.hpp>
#include <flyball/systems/any_model.hpp>

namespace flyball {

/// One step of the classical Runge-Kutta method for a model, the input held constant over the step:
/// `rk4` of fixed_step.hpp with the model's derivative. No allocation for models of fixed size.
template <class M, class State, class Input>
  requires Model<M>
[[nodiscard]] State rk4(M&& model, const State& x, const Input& u, double dt) {
  return rk4([&](const State& at) { return State(model.derivative(at, u)); }, x, dt);
}

/// RK4 steps of a model whose size is known at run time, in memory that is allocated once.
class ModelStepper {
 public:
  /// Steps of this model.
  explicit ModelStepper(AnyModel model) : model_(std::move(model)), work_(3 * model_.states()) {}

  /// @param x  n x 1, the state, replaced by that `dt` seconds later. @param u  m x 1, held.
  /// Cost: four calls of the model; no allocation where the model makes none.
  void step(VectorOut x, const VectorIn& u, double dt) noexcept { model_.step(x, u, dt, work_); }

  [[nodiscard]] const AnyModel& model() const noexcept { return model_; }

 private:
  AnyModel model_;
  Eigen::VectorXd work_;
};

/// A model and its input as `integrate` takes them: f(t, x) with its exact Jacobian.
template <class M, class Input>
class DrivenModel {
 public:
  /// @param input  m x 1, or a function of the time.
  DrivenModel(M model, Input input) : model_(std::move(model)), input_(std::move(input)) {}

  template <class State>
  [[nodiscard]] auto operator()(double t, const State& x) const {
    return model_.derivative(x, input(t)).eval();
  }
  template <class State>
  [[nodiscard]] Eigen::Matrix<double, State::RowsAtCompileTime, State::RowsAtCompileTime> jacobian(
      double t, const State& x) const {
    const InputOf<M> u = input(t);
    if constexpr (requires(Eigen::MatrixXd A) { model_.jacobians(x, u, A, A); }) {
      Eigen::MatrixXd A(x.size(), x.size());
      Eigen::MatrixXd B(x.size(), u.size());
      model_.jacobians(x, u, A, B);
      return A;
    } else {
      return flyball::jacobian([&](const auto& at) { return model_.derivative(at, u); }, x);
    }
  }

 private:
  [[nodiscard]] InputOf<M> input(double t) const {
    if constexpr (requires { typename Input::Scalar; }) {
      return input_;
    } else {
      return input_(t);
    }
  }

  M model_;
  Input input_;
};

/// @param u  m x 1, held; or a function u(t) of the time in seconds.
/// ```
/// const auto swing = integrate(with_input(pendulum, u), 0.0, x0, 10.0).value();
/// ```
template <Model M, class Input>
[[nodiscard]] auto with_input(const M& model, const Input& u) {
  if constexpr (requires { typename Input::Scalar; }) {
    return DrivenModel<M, InputOf<M>>(model, InputOf<M>(u));
  } else {
    return DrivenModel<M, Input>(model, u);
  }
}

}  // namespace flyball
