#pragma once

#include <limits>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/drivetrain/robot_body.hpp>
#include <flyball/mechanisms/elevator.hpp>

namespace flyball::mechanisms {

/// What pulls an elevator up beside its motors.
struct Counterbalance {
  static constexpr std::size_t carriage = std::numeric_limits<std::size_t>::max();

  Force force{};  ///< At the lowest position, upward. Of a constant-force spring, all of it.
  double stiffness = 0.0;  ///< N/m, by which it falls as what it pulls rises; 0: constant force.
  std::size_t stage = carriage;  ///< Which stage it pulls, from 0, the first that moves.
};

/// What an elevator of several stages is made of.
struct CascadeElevatorParameters {
  /// Its motors, their gearing to the drum, what turns with the drum and its friction.
  DriveShaft shaft{};
  Length drum_radius{};
  Mass carriage{};             ///< And what it carries.
  std::vector<Mass> stages{};  ///< That move, from the one that the drum pulls; empty: none.
  Counterbalance counterbalance{};
};

/// An elevator whose stages pull each other (cascade rigging), with a counterbalance: the drum
/// pulls the first stage, each stage the next by as much again, so that of n stages, the carriage
/// the last, stage k is at k/n of the carriage's height x,
///
///     M d²x/dt² = τ/(n r) - W + F - κ x,
///     M = Σ m_k (k/n)² + J/(n r)²,  W = g Σ m_k k/n,  F = f s,  κ = stiffness s²,
///
/// with s = k/n of the stage that the spring pulls, and the drum's torque τ = G K_t (V - e)/R less
/// friction at its speed Ω = (dx/dt)/(n r), e = G Ω/K_v. One stage without a spring is Theorem
/// 6.9.1.
///
/// x = [position (m), velocity (m/s)] of the carriage, u = voltage (V), y = position. Its
/// parameters are M (kg), W (N), F (N) and κ (N/m), at the carriage. Made by `cascade_elevator`.
/// Source: book, section 12.2, with the virtual work of what moves along.
class CascadeElevator {
 public:
  /// The size of x.
  static constexpr int states() { return 2; }
  /// The size of u, and how many drives it has.
  static constexpr int inputs() { return 1; }

  /// Of numbers that are known to be good; `cascade_elevator` checks them. @param arm  n r, m.
  CascadeElevator(const detail::Shaft& shaft, double arm, double inertia, double weight,
                  double force, double stiffness, double nominal_voltage) noexcept
      : shaft_(shaft),
        arm_(arm),
        nominal_voltage_(nominal_voltage),
        p_(inertia, weight, force, stiffness) {}

  /// [M, W, F, κ].
  [[nodiscard]] const Eigen::Vector4d& parameters() const noexcept { return p_; }
  /// Its drive's numbers.
  [[nodiscard]] const detail::Shaft& shaft(int /*motor*/) const noexcept { return shaft_; }
  /// n r, m the carriage rises per radian of the drum.
  [[nodiscard]] double rise() const noexcept { return arm_; }
  /// rad/s, of the motor, over a generic scalar.
  template <class X>
  [[nodiscard]] typename X::Scalar motor_speed(const X& x, int /*motor*/) const {
    return shaft_.gearing / arm_ * x(1);
  }
  /// The force on the carriage, N: the drive's, less weight, and the spring's.
  template <class Scalar, class P>
  [[nodiscard]] Scalar force(const Scalar& position, const Scalar& velocity, const Scalar& voltage,
                             const P& p) const {
    return shaft_.torque(Scalar(velocity / arm_), voltage) / arm_ - p(1) + p(2) - p(3) * position;
  }
  /// dx/dt over a generic scalar. @param x  2 x 1. @param u  1 x 1. @param p  The parameters.
  template <class X, class U, class P>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    using Scalar = ScalarOf<X, U, P>;
    return Eigen::Vector<Scalar, 2>{x(1),
                                    force(Scalar(x(0)), Scalar(x(1)), Scalar(u(0)), p) / p(0)};
  }
  /// The same with its own parameters.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return derivative(x, u, p_);
  }
  /// The position.
  template <class X, class U>
  [[nodiscard]] auto output(const X& x, const U&) const {
    return Eigen::Vector<ScalarOf<X, U>, 1>{x(0)};
  }
  /// V that hold the carriage at a position (m).
  [[nodiscard]] double holding_voltage(double position) const noexcept {
    return shaft_.R * arm_ * (p_(1) - p_(2) + p_(3) * position) / (shaft_.gearing * shaft_.Kt);
  }
  /// Where weight and spring balance, m; NaN for a spring that is constant.
  [[nodiscard]] double balanced_position() const noexcept {
    return p_(3) > 0.0 ? (p_(2) - p_(1)) / p_(3) : std::numeric_limits<double>::quiet_NaN();
  }
  /// The same elevator as Theorem 6.9.1's with its gains, for design: kG is the voltage that holds
  /// it (negative where the spring lifts more than there is), kS what its friction takes.
  /// @errors ArgumentError::out_of_range where the spring is not constant: then `linearize` it.
  [[nodiscard]] Expected<Elevator> elevator() const;
  /// Names and units.
  [[nodiscard]] ModelDescription description() const;

 private:
  detail::Shaft shaft_;
  double arm_;
  double nominal_voltage_;
  Eigen::Vector4d p_;
};

/// @errors ArgumentError::not_positive, not_finite for numbers that are not; out_of_range for a
///         negative mass of a stage, force or stiffness, and a spring on a stage that is not there.
[[nodiscard]] Expected<CascadeElevator> cascade_elevator(
    const CascadeElevatorParameters& parameters);

}  // namespace flyball::mechanisms
