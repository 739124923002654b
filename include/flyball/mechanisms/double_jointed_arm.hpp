#pragma once

#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/lagrangian/two_link.hpp>
#include <flyball/mechanisms/motor.hpp>
#include <flyball/systems/model.hpp>

namespace flyball::mechanisms {

/// A motor on a joint through a gearbox: τ = k V - c ω, with k = G K_t/R and c = G² K_t/(K_v R).
struct JointDrive {
  double gain = 0.0;     ///< k, N m/V.
  double damping = 0.0;  ///< c, N m s/rad: the back EMF's.
};

/// Two links in a vertical plane with a motor on each joint; SI doubles, made by
/// `double_jointed_arm`.
///
/// M(q) dv/dt + C(q, v) v + G(q) = τ, τ_i = k_i V_i - c_i v_i (12.1, 12.2 through the gearing);
/// x = [θ₁, θ₂ (rad), ω₁, ω₂ (rad/s)], u = [V₁, V₂] (V), y = [θ₁, θ₂]. θ₁ = 0 is horizontal, θ₂ is
/// relative to the first link; counter-clockwise. The second motor turns against the first link;
/// what its mass adds belongs to that link. As τ_g, gravity's torque is -G. Source: book,
/// section 13.2 (Tedrake, "Underactuated Robotics", appendix on multi-body dynamics).
struct DoubleJointedArm {
  TwoLink links{};
  JointDrive first{};   ///< Of the shoulder.
  JointDrive second{};  ///< Of the elbow.

  /// The size of x.
  static constexpr int states() { return 4; }
  /// The size of u.
  static constexpr int inputs() { return 2; }

  /// M(q), 2 x 2. @param q  2 x 1, rad.
  template <class Q>
  [[nodiscard]] auto mass_matrix(const Q& q) const {
    return links.mass_matrix(q);
  }
  /// C(q, v), 2 x 2. @param v  2 x 1, rad/s.
  template <class Q, class V>
  [[nodiscard]] auto coriolis_matrix(const Q& q, const V& v) const {
    return links.coriolis_matrix(q, v);
  }
  /// G(q), N m, 2 x 1: what holds it.
  template <class Q>
  [[nodiscard]] auto gravity_vector(const Q& q) const {
    using std::cos;
    using S = typename Q::Scalar;
    const S far = links.second_moment * cos(S(q(0) + q(1)));
    return Eigen::Vector<S, 2>{links.first_moment * cos(S(q(0))) + far, far};
  }
  /// τ = M a + C v + G, N m: the torques of a motion. @param q, v, a  2 x 1.
  template <class Q, class V, class A>
  [[nodiscard]] auto torques(const Q& q, const V& v, const A& a) const {
    return (mass_matrix(q) * a + coriolis_matrix(q, v) * v + gravity_vector(q)).eval();
  }
  /// The voltages of a motion, (τ + c ω)/k: the feedforward. @param q, v, a  2 x 1. Over a generic
  /// scalar, without allocation.
  template <class Q, class V, class A>
  [[nodiscard]] auto voltages(const Q& q, const V& v, const A& a) const {
    auto torque = torques(q, v, a);
    torque(0) = (torque(0) + first.damping * v(0)) / first.gain;
    torque(1) = (torque(1) + second.damping * v(1)) / second.gain;
    return torque;
  }

  /// dx/dt over a generic scalar. @param x  4 x 1. @param u  2 x 1, V.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    using S = ScalarOf<X, U>;
    const Eigen::Vector<S, 2> q{S(x(0)), S(x(1))};
    const Eigen::Vector<S, 2> v{S(x(2)), S(x(3))};
    const Eigen::Vector<S, 2> G = gravity_vector(q);
    const Eigen::Vector<S, 2> torque{first.gain * u(0) - first.damping * v(0) - G(0),
                                     second.gain * u(1) - second.damping * v(1) - G(1)};
    const Eigen::Vector<S, 2> a = links.acceleration(q, v, torque);
    return Eigen::Vector<S, 4>{v(0), v(1), a(0), a(1)};
  }
  /// [θ₁, θ₂].
  template <class X, class U>
  [[nodiscard]] auto output(const X& x, const U&) const {
    return Eigen::Vector<ScalarOf<X, U>, 2>{x(0), x(1)};
  }
  [[nodiscard]] ModelDescription description() const;
};

/// One joint of an arm, and the link that it turns.
struct JointParameters {
  DcMotor motor{};
  double gearing = 1.0;                 ///< Motor turns per turn of the joint (> 1 is a reduction).
  Length length{};                      ///< To the next joint.
  Mass mass{};                          ///< Of the link and what is fixed to it.
  Length center_of_mass{};              ///< From this joint.
  MomentOfInertia moment_of_inertia{};  ///< About the centre of mass.
};

/// What a double-jointed arm is made of.
struct DoubleJointedArmParameters {
  JointParameters first{};            ///< Shoulder and upper arm.
  JointParameters second{};           ///< Elbow and forearm.
  double gravity = standard_gravity;  ///< m/s²
};

/// @errors ArgumentError::not_positive for masses, the first length and the gearings, for motors
///         that are none and for a second link without inertia about its joint; out_of_range for
///         negative lengths, moments of inertia and gravity; not_finite.
[[nodiscard]] Expected<DoubleJointedArm> double_jointed_arm(
    const DoubleJointedArmParameters& parameters);

}  // namespace flyball::mechanisms
