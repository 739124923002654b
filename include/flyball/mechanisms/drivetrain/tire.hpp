#pragma once

#include <cmath>

#include <Eigen/Core>

namespace flyball::mechanisms {

/// How a wheel holds on to the floor, along its rolling direction and across it at once.
///
/// Where the wheel's surface moves over the floor with v_s (m/s) while it rolls at r Ω, the slip is
/// σ = v_s/√((r Ω)² + v_0²) and the floor's force on the wheel
///
///     F = -μ N sin(C atan(B |σ|)) σ/|σ|,    B = stiffness/(μ C),
///
/// which points against the sliding, is stiffness · N · σ for little slip, and never leaves the
/// friction circle |F| <= μ N. It is smooth everywhere. Around standstill it is a damper of
/// stiffness · N/v_0, which creeps where a wheel would stick.
///
/// The defaults are assumptions for a rubber tread on carpet, not measurements.
/// Source: Pacejka, "Tire and Vehicle Dynamics" (3rd ed., 2012): theoretical slip as a vector
/// (section 3.2), the magic formula with E = 0 (section 4.3).
struct Tire {
  double friction = 1.1;    ///< μ, the largest force over the load.
  double stiffness = 20.0;  ///< Force over load per slip, where there is little of it.
  double shape = 1.3;       ///< C, in [1, 2]: above 1 a wheel that slides holds less than its most.
  double rest_speed = 0.05;  ///< v_0, m/s, of rolling, below which sliding counts as over this.

  /// sin(C atan(B σ))/σ · μ, over a generic scalar: the force is -N · this · σ.
  template <class Scalar, class Mu, class Stiffness>
  [[nodiscard]] Scalar grip(const Scalar& slip, const Mu& mu, const Stiffness& slope) const {
    using std::atan;
    using std::sin;
    // slip > 0: force() keeps it off zero.
    return mu * sin(shape * atan(slope / (mu * shape) * slip)) / slip;
  }
  /// The floor's force on the wheel, N, over a generic scalar.
  /// @param sliding  v_s, m/s: of the contact over the floor, its rolling taken off; 2 x 1.
  /// @param rolling  r Ω, m/s. @param load  N >= 0, N.
  template <class Scalar, class Load, class Mu, class Stiffness>
  [[nodiscard]] Eigen::Vector<Scalar, 2> force(const Eigen::Vector<Scalar, 2>& sliding,
                                               const Scalar& rolling, const Load& load,
                                               const Mu& mu, const Stiffness& slope) const {
    using std::sqrt;
    const Scalar reference = sqrt(Scalar(rolling * rolling + rest_speed * rest_speed));
    // 1e-12 is far below any slip, and keeps the root's derivative finite without any.
    const Scalar slip = sqrt(Scalar(sliding(0) * sliding(0) + sliding(1) * sliding(1) +
                                    Scalar(1e-24) * reference * reference)) /
                        reference;
    const Scalar scale = -load * grip(slip, mu, slope) / reference;
    return {scale * sliding(0), scale * sliding(1)};
  }
  /// The same with its own friction and stiffness.
  template <class Scalar, class Load>
  [[nodiscard]] Eigen::Vector<Scalar, 2> force(const Eigen::Vector<Scalar, 2>& sliding,
                                               const Scalar& rolling, const Load& load) const {
    return force(sliding, rolling, load, friction, stiffness);
  }
  /// A wheel with rollers holds along their axis only: the force along it, N.
  /// @param sliding  m/s, along the axis. @param rolling  m/s. @param load  N.
  template <class Scalar, class Load, class Mu, class Stiffness>
  [[nodiscard]] Scalar force_along(const Scalar& sliding, const Scalar& rolling, const Load& load,
                                   const Mu& mu, const Stiffness& slope) const {
    return force(Eigen::Vector<Scalar, 2>(sliding, Scalar(0.0)), rolling, load, mu, slope)(0);
  }
};

}  // namespace flyball::mechanisms
