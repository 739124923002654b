#pragma once

#include <array>
#include <cmath>

#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/gravity.hpp>
#include <flyball/systems/model.hpp>

namespace flyball::mechanisms {

/// A pole with its mass at the end, hinged on a cart that a force pushes along a track; SI doubles,
/// made by `cart_pole`.
///
/// With the pole's mass at (p + l sin θ, -l cos θ), Lagrange's equations of
/// L = (m_c + m_p) ṗ²/2 + m_p l ṗ θ̇ cos θ + m_p l² θ̇²/2 + m_p g l cos θ are
///
///   (m_c + m_p) p̈ + m_p l (θ̈ cos θ - θ̇² sin θ) = F,   l θ̈ + p̈ cos θ + g sin θ = 0.
///
/// x = [p (m), θ (rad), ṗ (m/s), θ̇ (rad/s)], u = F (N), y = [p, θ]. θ = 0 hangs, θ = π stands;
/// counter-clockwise.
/// Source: book, section 13.3 (Tedrake, "Underactuated Robotics", chapter 3).
struct CartPole {
  double cart_mass = 1.0;             ///< m_c, kg.
  double pole_mass = 0.1;             ///< m_p, kg.
  double pole_length = 0.5;           ///< l, m, from the hinge to the mass.
  double gravity = standard_gravity;  ///< g, m/s².

  /// The size of x.
  static constexpr int states() { return 4; }
  /// The size of u.
  static constexpr int inputs() { return 1; }
  /// [m_c, m_p, l, g].
  [[nodiscard]] Eigen::Vector4d parameters() const {
    return {cart_mass, pole_mass, pole_length, gravity};
  }
  /// dx/dt over a generic scalar. @param x  4 x 1. @param u  1 x 1. @param p  The parameters.
  template <class X, class U, class P>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    using std::cos;
    using std::sin;
    using Scalar = ScalarOf<X, U, P>;
    const auto& [m_c, m_p, l, g] = std::array{p(0), p(1), p(2), p(3)};
    const Scalar s = sin(Scalar(x(1)));
    const Scalar c = cos(Scalar(x(1)));
    // The equations solved for p̈ and θ̈; m_c + m_p sin²θ is the determinant over m_p l².
    const Scalar push = u(0) + m_p * l * x(3) * x(3) * s;
    const Scalar inertia = m_c + m_p * s * s;
    return Eigen::Vector<Scalar, 4>{x(2), x(3), (push + m_p * g * s * c) / inertia,
                                    -(push * c + (m_c + m_p) * g * s) / (l * inertia)};
  }
  /// The same with its own parameters.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return derivative(x, u, parameters());
  }
  /// [p, θ].
  template <class X, class U>
  [[nodiscard]] auto output(const X& x, const U&) const {
    return Eigen::Vector<ScalarOf<X, U>, 2>{x(0), x(1)};
  }
  [[nodiscard]] ModelDescription description() const;
};

/// What a cart-pole is made of.
struct CartPoleParameters {
  Mass cart_mass{};
  Mass pole_mass{};                   ///< At the end of the pole.
  Length pole_length{};               ///< From the hinge to the mass.
  double gravity = standard_gravity;  ///< m/s²
};

/// @errors ArgumentError::not_positive for masses and length, out_of_range for a negative gravity,
///         not_finite.
[[nodiscard]] Expected<CartPole> cart_pole(const CartPoleParameters& parameters);

}  // namespace flyball::mechanisms
