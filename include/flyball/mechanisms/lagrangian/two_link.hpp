#pragma once

#include <cmath>

#include <Eigen/Core>

#include <flyball/mechanisms/gravity.hpp>

namespace flyball::mechanisms {

/// A link of a two-link mechanism, from its joint.
struct TwoLinkPart {
  double length = 1.0;             ///< l, m, to the next joint.
  double mass = 1.0;               ///< m, kg.
  double center_of_mass = 0.5;     ///< r, m, from the joint.
  double moment_of_inertia = 0.0;  ///< I, kg m², about the centre of mass.
};

/// The manipulator equations of two links in a vertical plane, the second joint's angle relative to
/// the first link: M(q) dv/dt + C(q, v) v + G(q) = τ.
///
///   M = [a + b + 2 d cos q₂,  b + d cos q₂;  b + d cos q₂,  b],
///   C = d sin q₂ [-v₂,  -(v₁ + v₂);  v₁,  0],
///   a = I₁ + m₁ r₁² + m₂ l₁²,  b = I₂ + m₂ r₂²,  d = m₂ l₁ r₂.
///
/// Gravity's G is that of the direction that zero angles mean.
/// Source: book, section 13.2 (Tedrake, "Underactuated Robotics", appendix on multi-body dynamics).
struct TwoLink {
  double a = 0.0;              ///< kg m²
  double b = 0.0;              ///< kg m²
  double d = 0.0;              ///< kg m²
  double first_moment = 0.0;   ///< (m₁ r₁ + m₂ l₁) g, N m.
  double second_moment = 0.0;  ///< m₂ r₂ g, N m.

  TwoLink() = default;
  /// @param g  m/s²
  TwoLink(const TwoLinkPart& first, const TwoLinkPart& second, double g = standard_gravity)
      : a(first.moment_of_inertia + first.mass * first.center_of_mass * first.center_of_mass +
          second.mass * first.length * first.length),
        b(second.moment_of_inertia + second.mass * second.center_of_mass * second.center_of_mass),
        d(second.mass * first.length * second.center_of_mass),
        first_moment((first.mass * first.center_of_mass + second.mass * first.length) * g),
        second_moment(second.mass * second.center_of_mass * g) {}

  /// M(q). @param q  2 x 1, rad, over a generic scalar.
  template <class Q>
  [[nodiscard]] auto mass_matrix(const Q& q) const {
    using std::cos;
    using S = typename Q::Scalar;
    const S coupling = d * cos(S(q(1)));
    Eigen::Matrix<S, 2, 2> M;
    M(0, 0) = a + b + 2.0 * coupling;
    M(0, 1) = b + coupling;
    M(1, 0) = M(0, 1);
    M(1, 1) = S(b);
    return M;
  }
  /// C(q, v). @param q, v  2 x 1, rad and rad/s.
  template <class Q, class V>
  [[nodiscard]] auto coriolis_matrix(const Q& q, const V& v) const {
    using std::sin;
    using S = typename Q::Scalar;
    const S twist = d * sin(S(q(1)));
    Eigen::Matrix<S, 2, 2> C;
    C(0, 0) = -twist * v(1);
    C(0, 1) = -twist * (v(0) + v(1));
    C(1, 0) = twist * v(0);
    C(1, 1) = S(0.0);
    return C;
  }
  /// dv/dt for torques that are left when gravity's are taken off, over a generic scalar.
  /// @param q, v  2 x 1. @param torque  2 x 1, N m: τ - G.
  template <class Q, class V, class T>
  [[nodiscard]] auto acceleration(const Q& q, const V& v, const T& torque) const {
    using std::cos;
    using std::sin;
    using S = typename T::Scalar;
    const S c = d * cos(S(q(1)));
    const S s = d * sin(S(q(1)));
    const S first = torque(0) + s * v(1) * (2.0 * v(0) + v(1));
    const S second = torque(1) - s * v(0) * v(0);
    const S off = b + c;
    // det M = a b - d² cos² q₂ > 0
    const S determinant = a * b - c * c;
    return Eigen::Vector<S, 2>{(b * first - off * second) / determinant,
                               ((a + b + 2.0 * c) * second - off * first) / determinant};
  }
  /// ½ vᵀ M v, J.
  template <class Q, class V>
  [[nodiscard]] auto kinetic_energy(const Q& q, const V& v) const {
    using std::cos;
    const auto c = d * cos(q(1));
    return 0.5 * (a + b + 2.0 * c) * v(0) * v(0) + (b + c) * v(0) * v(1) + 0.5 * b * v(1) * v(1);
  }
};

}  // namespace flyball::mechanisms
