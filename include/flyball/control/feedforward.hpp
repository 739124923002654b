#pragma once

#include <flyball/core/instantiated.hpp>
#include <flyball/core/signal.hpp>
#include <flyball/math/dense/linear_algebra.hpp>
#include <flyball/mechanisms/mechanism.hpp>
#include <flyball/systems/system.hpp>

namespace flyball {

namespace detail {
struct LinearPlantInversionDefinitions;  ///< Complete where the .tpp is included.
}

/// Linear plant inversion: the input that takes a discrete plant from one reference to the next.
///
/// u = B⁺ (r_{k+1} - A r_k) (7.16). Allocation-free for sizes known at compile time.
/// Source: book, Theorem 7.8.1.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic>
class LinearPlantInversion {
 public:
  static_assert(
      detail::has_definitions<detail::LinearPlantInversionDefinitions, States, Inputs>,
      "the library has no code for this size: #include <flyball/control/feedforward.tpp> first");

  using StateVector = Eigen::Matrix<double, States, 1>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;
  using StateMatrix = Eigen::Matrix<double, States, States>;
  using InverseMatrix = Eigen::Matrix<double, Inputs, States>;

  /// @param A  n x n, discrete. @param B_pinv  m x n; `linear_plant_inversion` computes it.
  LinearPlantInversion(const StateMatrix& A, const InverseMatrix& B_pinv)
      : A_(A), B_pinv_(B_pinv) {}

  /// @param r  The reference now. @param r_next  The reference one period later.
  /// @return u; zero where it is not a finite number (see largest_signal).
  [[nodiscard]] InputVector calculate(const StateVector& r,
                                      const StateVector& r_next) const noexcept;

  [[nodiscard]] const InverseMatrix& B_pinv() const noexcept { return B_pinv_; }

 private:
  StateMatrix A_;
  InverseMatrix B_pinv_;
};

/// The plant inversion of a discrete plant. @errors ArgumentError for a malformed system.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<LinearPlantInversion<States, Inputs>> linear_plant_inversion(
    const DiscreteSystem<States, Inputs, Outputs>& plant) {
  if (auto checked = check_system(plant, "linear_plant_inversion"); !checked) {
    return tl::unexpected(checked.error());
  }
  return pseudoinverse(plant.B).map([&](const Pseudoinverse& B_pinv) {
    return LinearPlantInversion<States, Inputs>(plant.A, B_pinv.X);
  });
}

/// The feedforward of section 14.2 in volts: kS sgn(v) + kV v + kA a + gravity, and its terms.
/// The signs and angles are the reference's, so that noise in a measurement cannot enter.
class SimpleFeedforward {
 public:
  /// @param kind   Decides the form of gravity.
  /// @param gains  kV > 0, kS >= 0, kA >= 0.
  /// @param period  T > 0, s, for `calculate_discrete`.
  /// @errors ArgumentError::not_positive, out_of_range, not_finite.
  [[nodiscard]] static Expected<SimpleFeedforward> create(mechanisms::MechanismKind kind,
                                                          const mechanisms::FeedforwardGains& gains,
                                                          Time period);

  /// Gravity, V: 0, kG, or kG cos(position + angle_offset) (6.9.3, 6.11.3); 0 at a position that is
  /// not a finite number.
  [[nodiscard]] double gravity(double position) const noexcept {
    return detail::signal_or_zero(gains_.gravity_voltage(kind_, position));
  }
  /// Static friction, V: kS sgn(velocity), zero at rest.
  [[nodiscard]] double friction(double velocity) const noexcept {
    return mechanisms::friction_voltage(gains_.kS, velocity);
  }
  /// What the linear model does not hold, V: gravity + friction.
  [[nodiscard]] double disturbance(double position, double velocity) const noexcept {
    return gravity(position) + friction(velocity);
  }

  /// kS sgn(v) + kV v + kA a + gravity, V; zero where that is not a finite number (see
  /// largest_signal). @param position  m or rad; only arms use it.
  [[nodiscard]] double calculate(double position, double velocity,
                                 double acceleration) const noexcept {
    return detail::signal_or_zero(disturbance(position, velocity) + gains_.kV * velocity +
                                  gains_.kA * acceleration);
  }

  /// The voltage that, held for one period, takes the velocity exactly from `velocity` to
  /// `next_velocity`: disturbance + (v_{k+1} - A_d v_k)/B_d with A_d = e^{-kV/kA T} and
  /// B_d = (1 - A_d)/kV; kA = 0 leaves kV v_{k+1}. Zero where it is not a finite number.
  /// Source: book, Theorem 7.8.1 on the model of 14.2.
  [[nodiscard]] double calculate_discrete(double position, double velocity,
                                          double next_velocity) const noexcept {
    // Friction is of the motion that is asked for: at the start of one, the next velocity's.
    const double direction = velocity != 0.0 ? velocity : next_velocity;
    return detail::signal_or_zero(disturbance(position, direction) + next_gain_ * next_velocity -
                                  gain_ * velocity);
  }

  [[nodiscard]] const mechanisms::FeedforwardGains& gains() const noexcept { return gains_; }
  [[nodiscard]] mechanisms::MechanismKind kind() const noexcept { return kind_; }

 private:
  SimpleFeedforward(mechanisms::MechanismKind kind, const mechanisms::FeedforwardGains& gains,
                    Time period) noexcept;

  mechanisms::MechanismKind kind_;
  mechanisms::FeedforwardGains gains_;
  double next_gain_;  ///< 1/B_d, V·s/unit
  double gain_;       ///< A_d/B_d, V·s/unit
};

#define FLYBALL_STATES_INPUTS(States, Inputs) \
  extern template class LinearPlantInversion<States, Inputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
