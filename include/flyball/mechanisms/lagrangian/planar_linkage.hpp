#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include <flyball/mechanisms/gravity.hpp>
#include <flyball/mechanisms/lagrangian/lagrangian_model.hpp>

/// Energies of what moves in a plane, from where its masses are.
namespace flyball::mechanisms {

/// A body that moves in a vertical plane: a point mass has no moment of inertia.
struct PlanarBody {
  double mass = 0.0;               ///< kg
  double moment_of_inertia = 0.0;  ///< kg m², about its centre of mass.
};

/// Where a body is: its centre of mass, y upwards, and how it is turned.
template <class S>
struct PlanarPose {
  S x{0.0};      ///< m
  S y{0.0};      ///< m
  S angle{0.0};  ///< rad
};

/// The energies of a linkage of which only the places of its bodies are said:
///
///   T = Σ ½ m (ẋ² + ẏ²) + ½ J φ̇²,  V = Σ m g y,
///
/// the velocities by automatic differentiation along q̇.
///
/// @tparam K  A type with `static constexpr int coordinates()`, `bodies()`, a std::array of
/// PlanarBody, and `poses(q)` over a generic scalar S: a std::array of as many PlanarPose of S. Its
/// `input_matrix`, `dissipation` and `description` count if it has them, as MechanicalEnergies
/// says. Source: book, chapter 13.
template <class K>
struct PlanarLinkage : K {
  double gravity = standard_gravity;  ///< g, m/s², along -y.

  PlanarLinkage() = default;
  /// @param kinematics  What K is made of. @param g  m/s².
  explicit PlanarLinkage(K kinematics, double g = standard_gravity)
      : K(std::move(kinematics)), gravity(g) {}

  /// J. @param q, v  n x 1.
  template <class Q, class V>
  [[nodiscard]] auto kinetic_energy(const Q& q, const V& v) const {
    using S = ScalarOf<Q, V>;
    using Along = NestedDual<S, 1>;
    Eigen::Vector<Along, K::coordinates()> path;
    for (int i = 0; i < K::coordinates(); ++i) {
      path(i) = Along(S(q(i)));
      path(i).gradient[0] = S(v(i));
    }
    const auto poses = K::poses(path);
    const auto bodies = K::bodies();
    S T(0.0);
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      const S& vx = poses[k].x.gradient[0];
      const S& vy = poses[k].y.gradient[0];
      const S& turning = poses[k].angle.gradient[0];
      T = T + 0.5 * bodies[k].mass * (vx * vx + vy * vy) +
          0.5 * bodies[k].moment_of_inertia * turning * turning;
    }
    return T;
  }
  /// J. @param q  n x 1.
  template <class Q>
  [[nodiscard]] auto potential_energy(const Q& q) const {
    using S = typename Q::Scalar;
    const auto poses = K::poses(q);
    const auto bodies = K::bodies();
    S V(0.0);
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      V = V + bodies[k].mass * gravity * poses[k].y;
    }
    return V;
  }
};

/// The model of a linkage. @param kinematics  As PlanarLinkage says. @param gravity  m/s².
/// @errors As `lagrangian_model`.
template <class K>
[[nodiscard]] Expected<LagrangianModel<PlanarLinkage<K>>> planar_model(
    K kinematics, double gravity = standard_gravity) {
  return lagrangian_model(PlanarLinkage<K>(std::move(kinematics), gravity));
}

/// A rigid link.
struct PlanarLink {
  double length = 1.0;             ///< m, from joint to joint.
  double mass = 1.0;               ///< kg
  double center_of_mass = 0.5;     ///< m, from the joint nearer to the base.
  double moment_of_inertia = 0.0;  ///< kg m², about its centre of mass.
};
/// A uniform rod: J = m l²/12.
[[nodiscard]] constexpr PlanarLink uniform_rod(double length, double mass) noexcept {
  return {length, mass, 0.5 * length, mass * length * length / 12.0};
}
/// A massless rod with a mass at its end.
[[nodiscard]] constexpr PlanarLink point_mass_link(double length, double mass) noexcept {
  return {length, mass, length, 0.0};
}

/// N links one behind the other from a fixed pivot, each joint's angle relative to the link before.
/// All zero: the chain lies along `zero_direction`.
template <int N>
struct PlanarChain {
  std::array<PlanarLink, static_cast<std::size_t>(N)> links{};
  /// rad, counter-clockwise from the horizontal: -π/2 hangs at zero, 0 lies.
  double zero_direction = 0.0;

  static constexpr int coordinates() { return N; }
  [[nodiscard]] auto bodies() const {
    std::array<PlanarBody, static_cast<std::size_t>(N)> all;
    for (std::size_t k = 0; k < links.size(); ++k) {
      all[k] = {links[k].mass, links[k].moment_of_inertia};
    }
    return all;
  }
  /// @param q  N x 1, rad.
  template <class Q>
  [[nodiscard]] auto poses(const Q& q) const {
    using std::cos;
    using std::sin;
    using S = typename Q::Scalar;
    std::array<PlanarPose<S>, static_cast<std::size_t>(N)> all;
    S x(0.0);
    S y(0.0);
    S angle(zero_direction);
    for (int k = 0; k < N; ++k) {
      const auto at = static_cast<std::size_t>(k);
      angle = angle + q(k);
      const S c = cos(angle);
      const S s = sin(angle);
      all[at] = {x + links[at].center_of_mass * c, y + links[at].center_of_mass * s, angle};
      x = x + links[at].length * c;
      y = y + links[at].length * s;
    }
    return all;
  }
};

}  // namespace flyball::mechanisms
