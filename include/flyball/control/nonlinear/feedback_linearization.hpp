#pragma once

#include <cmath>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/signal.hpp>
#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/systems/model.hpp>

namespace flyball {

namespace detail {

/// B⁺ y for a B of independent columns, by modified Gram-Schmidt; a column that depends on those
/// before it (to 1e-12 of its length) gets no input. Noexcept and free of allocation.
template <int N, int M>
[[nodiscard]] Eigen::Vector<double, M> least_squares_input(Eigen::Matrix<double, N, M> B,
                                                           Eigen::Vector<double, N> y) noexcept {
  Eigen::Matrix<double, M, M> R = Eigen::Matrix<double, M, M>::Zero();
  Eigen::Vector<double, M> c = Eigen::Vector<double, M>::Zero();
  for (int j = 0; j < M; ++j) {
    const double before = B.col(j).norm();
    for (int i = 0; i < j; ++i) {
      R(i, j) = B.col(i).dot(B.col(j));
      B.col(j) -= R(i, j) * B.col(i);
    }
    R(j, j) = B.col(j).norm();
    if (!(R(j, j) > 1e-12 * before)) {
      R(j, j) = 0.0;
      B.col(j).setZero();
      continue;
    }
    B.col(j) /= R(j, j);
    c(j) = B.col(j).dot(y);
    y -= c(j) * B.col(j);
  }
  Eigen::Vector<double, M> u = Eigen::Vector<double, M>::Zero();
  for (int j = M - 1; j >= 0; --j) {
    double rest = c(j);
    for (int k = j + 1; k < M; ++k) {
      rest -= R(j, k) * u(k);
    }
    u(j) = R(j, j) > 0.0 ? rest / R(j, j) : 0.0;
  }
  return u;
}

/// @errors Of `FeedbackLinearization::create`, for what does not depend on the model's type.
[[nodiscard]] Expected<void> check_feedback_linearization(
    const MatrixRef& f, const MatrixRef& B, const MatrixRef& f_at_u, const MatrixRef& u,
    const MatrixRef& error_gain, const MatrixRef& u_min, const MatrixRef& u_max);

}  // namespace detail

/// Feedback linearisation for reference tracking: a control-affine model dx/dt = f(x) + B(x) u is
/// given the dynamics of its reference and a linear error's,
///
///     u = B(x)⁺ (dr/dt + Λ (r - x) - f(x))                                             (8.3)
///
/// so that, where B has a row for every state, d(r - x)/dt = -Λ (r - x). Of a fully actuated
/// mechanism, x = [q, dq/dt] and B = [0; M⁻¹], it is computed torque: the rows of q are kinematics
/// that no input need cancel, and Λ = [0, 0; K_p, K_d] gives ë + K_d ė + K_p e = 0. f and B are the
/// model's own: B by dual numbers, exact. In a discrete loop dr/dt is (r_{k+1} - r_k)/T.
///
/// Run-time object: noexcept, allocation-free for models that are; finite and within the limits
/// whatever comes; what is not a finite number counts as no error and no motion.
/// Source: book, section 8.4.1; computed torque: Spong, Hutchinson, Vidyasagar, "Robot Modeling and
/// Control" (2006), section 8.3.
template <Model M>
class FeedbackLinearization {
 public:
  static constexpr int states = detail::fixed_states<M>();
  static constexpr int inputs = detail::fixed_inputs<M>();
  static_assert(states > 0 && inputs > 0, "the model's sizes must be known when compiling");
  using StateVector = Eigen::Vector<double, states>;
  using InputVector = Eigen::Vector<double, inputs>;
  using ErrorGain = Eigen::Matrix<double, states, states>;
  using InputMatrix = Eigen::Matrix<double, states, inputs>;

  /// @param model  Which is copied. @param error_gain  Λ, n x n, 1/s.
  /// @param u_min, u_max  Limits of each input; infinite for none.
  /// @param x  n x 1, a state at which the model is tried: affine in u, and an input reaches it.
  /// @errors ArgumentError::not_finite, out_of_range (limits in the wrong order; a model that is
  ///         not affine in its input at x), and those of `check_model`.
  [[nodiscard]] static Expected<FeedbackLinearization> create(const M& model,
                                                              const ErrorGain& error_gain,
                                                              const InputVector& u_min,
                                                              const InputVector& u_max,
                                                              const StateVector& x) {
    if (auto checked =
            check_model(model, x, InputVector(InputVector::Zero()), "FeedbackLinearization");
        !checked) {
      return tl::unexpected(std::move(checked).error());
    }
    FeedbackLinearization made(model, error_gain, u_min, u_max);
    // Any input shows whether the model is affine in it.
    const InputVector u = InputVector::LinSpaced(1.0, 2.0);
    auto checked = detail::check_feedback_linearization(made.drift(x), made.input_matrix(x),
                                                        StateVector(model.derivative(x, u)), u,
                                                        error_gain, u_min, u_max);
    if (!checked) {
      return tl::unexpected(std::move(checked).error());
    }
    return made;
  }

  /// @param x  n x 1, the state or its estimate. @param r  n x 1, the reference. @param r_rate
  /// dr/dt, n x 1.
  [[nodiscard]] InputVector calculate(const StateVector& x, const StateVector& r,
                                      const StateVector& r_rate) const noexcept {
    InputVector u = InputVector::Zero();
    if (flyball::is_signal(x)) {
      StateVector wanted = error_gain_ * error(x, r) + r_rate;
      detail::keep_signals(wanted);
      u = detail::least_squares_input<states, inputs>(input_matrix(x), wanted - drift(x));
    }
    for (int i = 0; i < inputs; ++i) {
      u(i) = detail::limited(u(i), u_min_(i), u_max_(i));
    }
    return u;
  }
  /// f(x), without input.
  [[nodiscard]] StateVector drift(const StateVector& x) const noexcept {
    return model_.derivative(x, InputVector(InputVector::Zero()));
  }
  /// B(x) = ∂f/∂u.
  [[nodiscard]] InputMatrix input_matrix(const StateVector& x) const noexcept {
    return jacobian([&](const auto& u) { return model_.derivative(x, u); },
                    InputVector(InputVector::Zero()));
  }
  [[nodiscard]] const M& model() const noexcept { return model_; }

 private:
  FeedbackLinearization(const M& model, const ErrorGain& error_gain, const InputVector& u_min,
                        const InputVector& u_max)
      : model_(model), error_gain_(error_gain), u_min_(u_min), u_max_(u_max) {
    const ModelDescription description = describe(model);
    for (int i = 0; i < states; ++i) {
      is_angle_(i) = description.states[static_cast<std::size_t>(i)].is_angle;
    }
  }
  [[nodiscard]] StateVector error(const StateVector& x, const StateVector& r) const noexcept {
    StateVector e = r - x;
    for (int i = 0; i < states; ++i) {
      e(i) = is_angle_(i) ? angle_difference(double(e(i)), 0.0) : e(i);
    }
    detail::keep_signals(e);
    return e;
  }

  M model_;
  ErrorGain error_gain_;
  InputVector u_min_;
  InputVector u_max_;
  Eigen::Vector<bool, states> is_angle_;
};

}  // namespace flyball
