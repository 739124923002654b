#pragma once

#include <flyball/math/derivatives/dual.hpp>
#include <flyball/math/integration/fixed_step.hpp>
#include <flyball/systems/model.hpp>
#include <flyball/systems/system.hpp>

/// What filters take for a model, and how they step it.
namespace flyball {

/// How a filter steps and reads a model: a Model by RK4 with the input held (as `rk4` of
/// model_step.hpp), one that has `next(x, u, dt)` over a generic scalar by that, a DiscreteSystem
/// by its matrices.
template <class M>
struct FilterModel {
  static constexpr int states = detail::fixed_states<M>();
  static constexpr int inputs = detail::fixed_inputs<M>();

  /// x after dt seconds, over a generic scalar. @param x  n x 1. @param u  m x 1. @param dt  s.
  template <class State, class Input>
  [[nodiscard]] static State next(const M& model, const State& x, const Input& u, double dt) {
    if constexpr (requires { State(model.next(x, u, dt)); }) {
      return model.next(x, u, dt);
    } else {
      return rk4([&](const State& at) { return State(model.derivative(at, u)); }, x, dt);
    }
  }
  /// y, over a generic scalar.
  template <class State, class Input>
  [[nodiscard]] static auto output(const M& model, const State& x, const Input& u) {
    if constexpr (requires { model.output(x, u); }) {
      return model.output(x, u).eval();
    } else {
      return State(x);
    }
  }
  /// Which outputs are angles.
  [[nodiscard]] static std::vector<Coordinate> outputs(const M& model) {
    if constexpr (Model<M>) {
      return describe(model).outputs;
    } else if constexpr (requires { model.description(); }) {
      return model.description().outputs;
    } else {
      return {};
    }
  }
  /// The number of states.
  [[nodiscard]] static Eigen::Index state_count(const M& model) { return model.states(); }
  /// The number of inputs.
  [[nodiscard]] static Eigen::Index input_count(const M& model) { return model.inputs(); }
};

/// A discrete system's, whose period is its own: dt is not asked for.
template <int States, int Inputs, int Outputs>
struct FilterModel<DiscreteSystem<States, Inputs, Outputs>> {
  using M = DiscreteSystem<States, Inputs, Outputs>;
  static constexpr int states = States;
  static constexpr int inputs = Inputs;

  template <class State, class Input>
  [[nodiscard]] static State next(const M& model, const State& x, const Input& u, double) {
    return model.A.lazyProduct(x) + model.B.lazyProduct(u);
  }
  template <class State, class Input>
  [[nodiscard]] static auto output(const M& model, const State& x, const Input& u) {
    return (model.C.lazyProduct(x) + model.D.lazyProduct(u)).eval();
  }
  [[nodiscard]] static std::vector<Coordinate> outputs(const M&) { return {}; }
  /// The number of states.
  [[nodiscard]] static Eigen::Index state_count(const M& model) { return model.A.rows(); }
  /// The number of inputs.
  [[nodiscard]] static Eigen::Index input_count(const M& model) { return model.B.cols(); }
};

namespace detail {

template <class M>
inline constexpr bool is_discrete_system = false;
template <int States, int Inputs, int Outputs>
inline constexpr bool is_discrete_system<DiscreteSystem<States, Inputs, Outputs>> = true;

/// Derivatives with respect to the N entries of an error; an even number of them, which is what
/// vector units take.
template <int N>
using ErrorDual = Dual<N == Eigen::Dynamic ? N : N + N % 2>;

/// Models that write their own derivatives.
template <class M>
concept HasJacobians =
    !is_discrete_system<M> &&
    requires(const M& model, const StateOf<M>& x, const InputOf<M>& u, Eigen::MatrixXd& J) {
      model.jacobians(x, u, J, J);
    } &&
    !requires(const M& model, const StateOf<M>& x, const InputOf<M>& u) { model.next(x, u, 0.0); };

/// RK4 of such a model and its derivatives with respect to x and, if G is there, to u:
/// K_i = A(x_i) ∂x_i/∂x and A(x_i) ∂x_i/∂u + B(x_i), the stages of the variational equation.
template <class M, class State, class Input, class Matrix, class InputMatrix>
void rk4_with_jacobians(const M& model, const State& x, const Input& u, double dt, State& next,
                        Matrix& F, InputMatrix* G) {
  const Eigen::Index n = x.size();
  const Matrix I = Matrix::Identity(n, n);
  Matrix A(n, n);
  InputMatrix B(n, u.size());
  State k = model.derivative(x, u);
  model.jacobians(x, u, A, B);
  Matrix K = A;
  InputMatrix L = B;
  State sum = k;
  Matrix sum_of_K = K;
  InputMatrix sum_of_L = L;
  for (int stage = 1; stage < 4; ++stage) {
    const double part = stage == 3 ? dt : 0.5 * dt;
    const double weight = stage == 3 ? 1.0 : 2.0;
    const State at = x + part * k;
    k = model.derivative(at, u);
    model.jacobians(at, u, A, B);
    const Matrix by_x = I + part * K;
    K = A.lazyProduct(by_x);
    sum += weight * k;
    sum_of_K += weight * K;
    if (G != nullptr) {
      const InputMatrix by_u = part * L;
      L = B + A.lazyProduct(by_u);
      sum_of_L += weight * L;
    }
  }
  next = x + (dt / 6.0) * sum;
  F = I + (dt / 6.0) * sum_of_K;
  if (G != nullptr) {
    *G = (dt / 6.0) * sum_of_L;
  }
}

/// RK4 and its derivative with respect to x by dual numbers. What is linear in the stages is done
/// on whole gradients, so that only the model itself computes with duals.
template <class M, class State, class Input, class Matrix>
void rk4_with_duals(const M& model, const State& x, const Input& u, double dt, State& next,
                    Matrix& F) {
  constexpr int N = State::RowsAtCompileTime;
  using T = ErrorDual<N>;
  using Duals = Eigen::Matrix<T, N, 1>;
  const Eigen::Index n = x.size();
  const Eigen::Index variables = N == Eigen::Dynamic ? n : N + N % 2;
  Duals at(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    at(i) = T::variable(x(i), i, variables);
  }
  Duals k = model.derivative(at, u);
  Duals sum = k;
  for (int stage = 1; stage < 4; ++stage) {
    const double part = stage == 3 ? dt : 0.5 * dt;
    const double weight = stage == 3 ? 1.0 : 2.0;
    for (Eigen::Index i = 0; i < n; ++i) {
      at(i).value = x(i) + part * k(i).value;
      if (k(i).gradient.size() == 0) {
        at(i).gradient.setZero();
      } else {
        at(i).gradient = part * k(i).gradient;
      }
      at(i).gradient(i) += 1.0;
    }
    k = model.derivative(at, u);
    for (Eigen::Index i = 0; i < n; ++i) {
      sum(i).value += weight * k(i).value;
      if (k(i).gradient.size() != 0) {
        if (sum(i).gradient.size() == 0) {
          sum(i).gradient.setZero(variables);
        }
        sum(i).gradient += weight * k(i).gradient;
      }
    }
  }
  const double sixth = dt / 6.0;
  F.setIdentity(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    next(i) = x(i) + sixth * sum(i).value;
    if (sum(i).gradient.size() != 0) {
      for (Eigen::Index j = 0; j < n; ++j) {
        F(i, j) += sixth * sum(i).gradient(j);
      }
    }
  }
}

/// f(x) of a filter's step: the model with its input and the time.
template <class M>
struct ModelStep {
  using State = Eigen::Matrix<double, FilterModel<M>::states, 1>;
  using Matrix = Eigen::Matrix<double, FilterModel<M>::states, FilterModel<M>::states>;
  using Input = Eigen::Matrix<double, FilterModel<M>::inputs, 1>;
  const M& model;
  const Input& u;
  double dt;

  template <class X>
  [[nodiscard]] X operator()(const X& x) const {
    return FilterModel<M>::next(model, x, u, dt);
  }
  // clang-format off
  void linearize(const State& x, State& next, Matrix& F) const
    requires(!requires { State(model.next(x, u, dt)); })
  // clang-format on
  {
    if constexpr (is_discrete_system<M>) {
      next = (*this)(x);
      F = model.A;
    } else if constexpr (HasJacobians<M>) {
      Eigen::Matrix<double, State::RowsAtCompileTime, Input::RowsAtCompileTime>* const none =
          nullptr;
      rk4_with_jacobians(model, x, u, dt, next, F, none);
    } else {
      rk4_with_duals(model, x, u, dt, next, F);
    }
  }
};

/// h(x) of a filter's correction.
template <class M>
struct ModelOutput {
  using State = Eigen::Matrix<double, FilterModel<M>::states, 1>;
  using Input = Eigen::Matrix<double, FilterModel<M>::inputs, 1>;
  const M& model;
  const Input& u;

  template <class X>
  [[nodiscard]] auto operator()(const X& x) const {
    return FilterModel<M>::output(model, x, u);
  }
  // clang-format off
  template <class Output, class Matrix>
  void linearize(const State& x, Output& y, Matrix& H) const
    requires(is_discrete_system<M> ||
             requires(Eigen::MatrixXd& J) { model.output_jacobians(x, u, J, J); })
  // clang-format on
  {
    y = (*this)(x);
    H.resize(y.size(), x.size());
    if constexpr (is_discrete_system<M>) {
      H = model.C;
    } else {
      Eigen::Matrix<double, Output::RowsAtCompileTime, Input::RowsAtCompileTime> D(y.size(),
                                                                                   u.size());
      model.output_jacobians(x, u, H, D);
    }
  }
};

}  // namespace detail

}  // namespace flyball
