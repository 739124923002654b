#pragma once

#include <cmath>

#include <flyball/mechanisms/lift/cascade_elevator.hpp>

namespace flyball::mechanisms {

/// What an arm on an elevator is made of.
struct ElevatorArmParameters {
  CascadeElevatorParameters elevator{};  ///< Without the arm.
  /// The arm's motors, their gearing to the joint, what turns with it and its friction.
  DriveShaft joint{};
  MomentOfInertia moment_of_inertia{};  ///< J of the arm about the joint.
  Mass mass{};                          ///< m of the arm.
  Length center_of_mass{};              ///< l, its distance from the joint.
};

/// A single-jointed arm on an elevator's carriage: they move each other.
///
///     x = [height h (m), angle θ (rad), dh/dt, dθ/dt],  u = [V_elevator, V_arm] (V),  y = [h, θ],
///
///     [M + m, m l cos θ; m l cos θ, J + J_s] [d²h; d²θ]
///         = [τ_e/(n r) - W - m g + F - κ h + m l sin θ (dθ/dt)²;  τ_a - m g l cos θ],
///
/// with the elevator's M, W, F, κ of `CascadeElevator` and the joint's J_s; θ = 0 is level.
/// Its parameters are M, W, F, κ, m, l, J + J_s. Made by `elevator_arm`.
/// Source: book, sections 12.2, 12.4; Lagrange's equations of T = M ḣ²/2 + m (ḣ² + 2 l ḣ θ̇ cos θ)/2
/// + (J + J_s) θ̇²/2.
class ElevatorArm {
 public:
  /// The size of x.
  static constexpr int states() { return 4; }
  /// The size of u, and how many drives it has.
  static constexpr int inputs() { return 2; }
  using Parameters = Eigen::Vector<double, 7>;

  /// Of numbers that are known to be good; `elevator_arm` checks them.
  ElevatorArm(const CascadeElevator& elevator, const detail::Shaft& joint, double mass,
              double length, double inertia) noexcept
      : elevator_(elevator), joint_(joint) {
    p_ << elevator.parameters(), mass, length, inertia;
  }

  /// [M, W, F, κ, m, l, J + J_s].
  [[nodiscard]] const Parameters& parameters() const noexcept { return p_; }
  /// The drives' numbers: the elevator's, the arm's.
  [[nodiscard]] const detail::Shaft& shaft(int motor) const noexcept {
    return motor == 0 ? elevator_.shaft(0) : joint_;
  }
  /// rad/s, of a motor, over a generic scalar.
  template <class X>
  [[nodiscard]] typename X::Scalar motor_speed(const X& x, int motor) const {
    using Scalar = typename X::Scalar;
    return motor == 0 ? Scalar(elevator_.shaft(0).gearing / elevator_.rise() * x(2))
                      : Scalar(joint_.gearing * x(3));
  }
  /// dx/dt over a generic scalar. @param x  4 x 1. @param u  2 x 1. @param p  The parameters.
  template <class X, class U, class P>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    using std::cos;
    using std::sin;
    using Scalar = ScalarOf<X, U, P>;
    const Scalar m = p(4);
    const Scalar l = p(5);
    const Scalar c = m * l * cos(Scalar(x(1)));
    const Scalar lift = elevator_.force(Scalar(x(0)), Scalar(x(2)), Scalar(u(0)), p) -
                        m * standard_gravity + m * l * sin(Scalar(x(1))) * x(3) * x(3);
    const Scalar turn = joint_.torque(Scalar(x(3)), Scalar(u(1))) - standard_gravity * c;
    const Scalar M = p(0) + m;
    const Scalar J = p(6);
    const Scalar determinant = M * J - c * c;
    return Eigen::Vector<Scalar, 4>{x(2), x(3), (J * lift - c * turn) / determinant,
                                    (M * turn - c * lift) / determinant};
  }
  /// The same with its own parameters.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return derivative(x, u, p_);
  }
  /// [h, θ].
  template <class X, class U>
  [[nodiscard]] auto output(const X& x, const U&) const {
    return Eigen::Vector<ScalarOf<X, U>, 2>{x(0), x(1)};
  }
  /// V of both drives that hold it at a height (m) and an angle (rad).
  [[nodiscard]] Eigen::Vector2d holding_voltages(double height, double angle) const noexcept {
    const double lift = p_(4) * standard_gravity;
    const detail::Shaft& drum = elevator_.shaft(0);
    return {elevator_.holding_voltage(height) +
                drum.R * elevator_.rise() * lift / (drum.gearing * drum.Kt),
            joint_.R * lift * p_(5) * std::cos(angle) / (joint_.gearing * joint_.Kt)};
  }
  /// Names and units; θ is an angle.
  [[nodiscard]] ModelDescription description() const;

 private:
  CascadeElevator elevator_;
  detail::Shaft joint_;
  Parameters p_;
};

/// @errors As `cascade_elevator`; ArgumentError::not_positive for the arm's J, negative mass or
///         length, out_of_range for a J below m l², which no arm has.
[[nodiscard]] Expected<ElevatorArm> elevator_arm(const ElevatorArmParameters& parameters);

}  // namespace flyball::mechanisms
