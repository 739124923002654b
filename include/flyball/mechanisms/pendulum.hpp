#pragma once

#include <array>
#include <cmath>

#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/gravity.hpp>
#include <flyball/systems/model.hpp>

namespace flyball::mechanisms {

/// A bob on a massless rod, turned about its pivot by a torque; SI doubles, made by `pendulum`.
///
/// m l² dω/dt = τ - c ω - m g l sin θ, dθ/dt = ω; x = [θ (rad), ω (rad/s)], u = τ (N m), y = θ.
/// θ = 0 hangs, θ = π stands; counter-clockwise.
/// Source: book, sections 8.5 and 12.5 (there without torque and damping).
struct Pendulum {
  double mass = 1.0;                  ///< m, kg.
  double length = 1.0;                ///< l, m, from the pivot to the bob.
  double damping = 0.0;               ///< c, N m s/rad, at the pivot.
  double gravity = standard_gravity;  ///< g, m/s².

  /// The size of x.
  static constexpr int states() { return 2; }
  /// The size of u.
  static constexpr int inputs() { return 1; }
  /// [m, l, c, g].
  [[nodiscard]] Eigen::Vector4d parameters() const { return {mass, length, damping, gravity}; }
  /// dx/dt over a generic scalar. @param x  2 x 1. @param u  1 x 1. @param p  The parameters.
  template <class X, class U, class P>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    using std::sin;
    using Scalar = ScalarOf<X, U, P>;
    const auto& [m, l, c, g] = std::array{p(0), p(1), p(2), p(3)};
    return Eigen::Vector<Scalar, 2>{x(1), (u(0) - c * x(1)) / (m * l * l) - g / l * sin(x(0))};
  }
  /// The same with its own parameters.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return derivative(x, u, parameters());
  }
  /// θ.
  template <class X, class U>
  [[nodiscard]] auto output(const X& x, const U&) const {
    return Eigen::Vector<ScalarOf<X, U>, 1>{x(0)};
  }
  [[nodiscard]] ModelDescription description() const;
};

/// What a pendulum is made of.
struct PendulumParameters {
  Mass mass{};
  Length length{};                    ///< From the pivot to the bob.
  double damping = 0.0;               ///< N m s/rad
  double gravity = standard_gravity;  ///< m/s²
};

/// @errors ArgumentError::not_positive for mass and length, out_of_range for a negative damping or
///         gravity, not_finite.
[[nodiscard]] Expected<Pendulum> pendulum(const PendulumParameters& parameters);

}  // namespace flyball::mechanisms
