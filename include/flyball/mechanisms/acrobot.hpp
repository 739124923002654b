#pragma once

#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/lagrangian/two_link.hpp>
#include <flyball/systems/model.hpp>

namespace flyball::mechanisms {

/// Two links that swing from a free pivot, with a torque at the elbow alone; SI doubles, made by
/// `acrobot`.
///
/// M(q) dv/dt + C(q, v) v + G(q) = [0; τ]; x = [θ₁, θ₂ (rad), ω₁, ω₂ (rad/s)], u = τ (N m),
/// y = [θ₁, θ₂]. θ₁ = 0 hangs, θ₂ is relative to the first link: [π, 0] stands; counter-clockwise.
/// Source: book, chapter 13 (Tedrake, "Underactuated Robotics", chapter 3); Spong, "The swing up
/// control problem for the Acrobot", IEEE Control Systems 15 (1995).
struct Acrobot {
  TwoLink links{};

  /// The size of x.
  static constexpr int states() { return 4; }
  /// The size of u.
  static constexpr int inputs() { return 1; }

  /// G(q), N m, 2 x 1. @param q  2 x 1, rad.
  template <class Q>
  [[nodiscard]] auto gravity_vector(const Q& q) const {
    using std::sin;
    using S = typename Q::Scalar;
    const S far = links.second_moment * sin(S(q(0) + q(1)));
    return Eigen::Vector<S, 2>{links.first_moment * sin(S(q(0))) + far, far};
  }
  /// Kinetic and potential energy, J, over a generic scalar; nothing at the height of the pivot.
  /// @param x  4 x 1.
  template <class X>
  [[nodiscard]] auto energy(const X& x) const {
    using std::cos;
    const auto q = x.template head<2>().eval();
    const auto v = x.template tail<2>().eval();
    return links.kinetic_energy(q, v) - links.first_moment * cos(q(0)) -
           links.second_moment * cos(q(0) + q(1));
  }
  /// The energy standing at rest, J.
  [[nodiscard]] double energy_upright() const noexcept {
    return links.first_moment + links.second_moment;
  }

  /// dx/dt over a generic scalar. @param x  4 x 1. @param u  1 x 1, N m.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    using S = ScalarOf<X, U>;
    const Eigen::Vector<S, 2> q{S(x(0)), S(x(1))};
    const Eigen::Vector<S, 2> v{S(x(2)), S(x(3))};
    const Eigen::Vector<S, 2> G = gravity_vector(q);
    const Eigen::Vector<S, 2> torque{-G(0), u(0) - G(1)};
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

/// One link of an acrobot.
struct AcrobotLink {
  Length length{};                      ///< To the next joint.
  Mass mass{};                          ///< Of the link.
  Length center_of_mass{};              ///< From the joint nearer to the pivot.
  MomentOfInertia moment_of_inertia{};  ///< About the centre of mass.
};
/// A uniform rod: its centre in the middle, J = m l²/12.
[[nodiscard]] AcrobotLink uniform_rod(Length length, Mass mass);

/// What an acrobot is made of.
struct AcrobotParameters {
  AcrobotLink first{};
  AcrobotLink second{};
  double gravity = standard_gravity;  ///< m/s²
};

/// @errors ArgumentError::not_positive for masses, the first length, and for a second link without
///         inertia about the elbow or a first without any; out_of_range for what is negative;
///         not_finite.
[[nodiscard]] Expected<Acrobot> acrobot(const AcrobotParameters& parameters);

}  // namespace flyball::mechanisms
