#pragma once

#include <flyball/control/lqr.hpp>
#include <flyball/core/signal.hpp>

namespace flyball {

/// Why integral action cannot be had.
enum class IntegralControlError {
  not_trackable,  ///< No constant input holds the tracked outputs at every value.
  not_matched,    ///< No combination of inputs acts like the disturbance.
};
[[nodiscard]] ErrorInfo error_info(IntegralControlError code);

/// A regulator with the integral of the tracked outputs' error, u = K (r - x) - K_I x_I.
struct IntegralLqr {
  Eigen::MatrixXd K;       ///< m x n
  Eigen::MatrixXd K_I;     ///< m x p
  Eigen::MatrixXd S;       ///< (n + p) x (n + p), cost-to-go of [x; x_I].
  Eigen::VectorXcd poles;  ///< n + p, of the augmented closed loop.
  double residual = 0.0;
  double condition = 0.0;
};

/// LQI: the regulator of a plant augmented with the integral of its outputs' error (6.7.1),
///
///   dx_I/dt = r_y - (C x + D u),   u = K (r - x) - K_I x_I,
///
/// sampled: x_I₊ = x_I + T (r_y - y). In steady state the outputs are at their references whatever
/// constant disturbance acts on the plant.
///
/// @param plant  Its outputs are what is tracked: at most as many as inputs.
/// @param Q  (n + p) x (n + p), the states' weights and then the integrals', in the order of the
///           outputs; `bryson` of all n + p tolerances makes it. @param R  m x m.
/// @errors ArgumentError for shapes, entries and asymmetry; IntegralControlError::not_trackable
///         with the smallest singular value of [A - I  B; C  D] where the plant cannot hold an
///         output (more outputs than inputs, or a zero at 1); RiccatiError as `lqr`.
/// Source: book, section 6.7.1.
[[nodiscard]] Expected<IntegralLqr> lqi(const DiscreteSystem<>& plant, const Weight& Q,
                                        const Weight& R);
/// The same for a continuous controller.
/// @errors As above, but [A  B; C  D] is what must have full rank (no zero at 0), and as `care`.
/// Cost: O((n + p)³), allocates.
[[nodiscard]] Expected<IntegralLqr> continuous_lqi(const ContinuousSystem<>& plant, const Weight& Q,
                                                   const Weight& R);

/// `lqi` of a plant of fixed sizes. @errors As `lqi`.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<IntegralLqr> lqi(const DiscreteSystem<States, Inputs, Outputs>& plant,
                                        const Weight& Q, const Weight& R) {
  return lqi(DiscreteSystem<>{plant.A, plant.B, plant.C, plant.D, plant.period}, Q, R);
}

/// The gain that cancels an estimated input error (6.7.2): u = K (r - x) - k_error u_error with
/// B k_error = B_error, of least norm. For B_error = B it is I where B's columns are independent,
/// and the gain of the augmented plant is [K k_error] (`augment_gain_input_error`).
/// @param B  n x m. @param B_error  n x q: what one unit of each disturbance adds to dx/dt (or to
/// x_{k+1}, with a discrete B).
/// @errors ArgumentError; IntegralControlError::not_matched with the share of B_error that no input
///         can cancel, above 1e-9.
/// Source: book, section 6.7.2.
[[nodiscard]] Expected<Eigen::MatrixXd> input_error_gain(const MatrixRef& B,
                                                         const MatrixRef& B_error);

/// State feedback with integral action and input limits, u = clamp(K (r - x) - K_I x_I + u_ff).
///
/// While an input is at a limit, the integral does not move further into it. Run-time object:
/// noexcept, finite and within the limits whatever comes; allocation-free for sizes known at
/// compile time. An output error that is not finite, or that would take the integral beyond
/// `largest_signal`, leaves it where it is.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic, int Outputs = Eigen::Dynamic>
class IntegralStateFeedback {
 public:
  using StateVector = Eigen::Matrix<double, States, 1>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;
  using OutputVector = Eigen::Matrix<double, Outputs, 1>;
  using Gain = Eigen::Matrix<double, Inputs, States>;
  using IntegralGain = Eigen::Matrix<double, Inputs, Outputs>;

  /// @param K  m x n. @param K_I  m x p. @param period  T > 0, s.
  /// @param u_min, u_max  Limits of each input; infinite for none.
  IntegralStateFeedback(const Gain& K, const IntegralGain& K_I, double period,
                        const InputVector& u_min, const InputVector& u_max)
      : K_(K),
        K_I_(K_I),
        period_(period),
        u_min_(u_min),
        u_max_(u_max),
        x_I_(OutputVector::Zero(K_I.cols())) {}

  /// One period. @param x  The state or its estimate. @param r  Its reference.
  /// @param y_error  r_y - y: of the tracked outputs, from the measurement.
  /// @param u_ff  Feedforward, added before the limits. @return u.
  [[nodiscard]] InputVector calculate(const StateVector& x, const StateVector& r,
                                      const OutputVector& y_error,
                                      const InputVector& u_ff) noexcept {
    InputVector u = u_ff;
    u.noalias() += K_ * (r - x);
    u.noalias() -= K_I_ * x_I_;
    const OutputVector integral = x_I_ + period_ * y_error;
    bool hold = !is_signal(integral);
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      const double wanted = u(i);
      u(i) = detail::limited(wanted, u_min_(i), u_max_(i));
      const double way = -K_I_.row(i).dot(y_error);
      hold = hold || (wanted > u(i) && way > 0.0) || (wanted < u(i) && way < 0.0);
    }
    if (!hold) {
      x_I_ = integral;
    }
    return u;
  }

  /// Starts again with a given integral, usually zero. @return  Whether it was taken: one that is
  /// not finite is not.
  bool reset(const OutputVector& x_I) noexcept {
    const bool usable = is_signal(x_I);
    if (usable) {
      x_I_ = x_I;
    }
    return usable;
  }
  [[nodiscard]] const OutputVector& integral() const noexcept { return x_I_; }
  [[nodiscard]] const Gain& K() const noexcept { return K_; }
  [[nodiscard]] const IntegralGain& K_I() const noexcept { return K_I_; }

 private:
  Gain K_;
  IntegralGain K_I_;
  double period_;
  InputVector u_min_;
  InputVector u_max_;
  OutputVector x_I_;
};

}  // namespace flyball
