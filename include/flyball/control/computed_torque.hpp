#pragma once

#include <cmath>
#include <numbers>

#include <Eigen/Core>

#include <flyball/core/signal.hpp>

namespace flyball {

/// A fully actuated mechanism's regulator by feedback linearisation (computed torque): whatever the
/// mechanism's dynamics, its error obeys ë + K_d ė + K_p e = 0, e = r - q.
///
///   a = r̈ + K_d (ṙ - v) + K_p (r - q),  u = the inputs that make the mechanism accelerate so:
///   (8.3), u = B⁺(ẋ - f(x)), with the wanted ẋ = [v; a].
///
/// Run-time object: noexcept, allocation-free, within the limits and finite whatever comes; where
/// the limits hold it back the error does what the mechanism lets it.
///
/// @tparam Mechanism  Has `voltages(q, v, a)`, n x 1: what accelerates it so, such as
/// `mechanisms::DoubleJointedArm`; or `forces(q, v, a)`, such as a `mechanisms::LagrangianModel`
/// with an input for each coordinate. Source: book, section 8.4.1, equation 8.3; Murray, Li and
/// Sastry, "A Mathematical Introduction to Robotic Manipulation", section 4.5.
template <class Mechanism, int N = Mechanism::inputs()>
class ComputedTorque {
 public:
  using Vector = Eigen::Vector<double, N>;

  /// @param stiffness  K_p, 1/s², n x 1, not negative. @param damping  K_d, 1/s, n x 1, not
  /// negative: 2 √K_p is critical. @param limit  Largest size of each input, n x 1; what is not a
  /// positive number counts as none.
  ComputedTorque(const Mechanism& mechanism, const Vector& stiffness, const Vector& damping,
                 const Vector& limit)
      : mechanism_(mechanism), stiffness_(stiffness), damping_(damping), limit_(limit) {
    for (int i = 0; i < N; ++i) {
      limit_(i) = limit(i) > 0.0 && limit(i) < largest_signal ? limit(i) : largest_signal;
    }
  }

  /// Declares a coordinate to be an angle: its error is taken the shorter way round.
  /// @param coordinate  Its index; out of range is ignored.
  void set_angle(int coordinate) noexcept {
    if (coordinate >= 0 && coordinate < N) {
      turns_(coordinate) = 2.0 * std::numbers::pi;
    }
  }

  /// The inputs. @param q, v  n x 1, where it is. @param r, r_dot, r_ddot  n x 1, where it should
  /// be.
  [[nodiscard]] Vector calculate(const Vector& q, const Vector& v, const Vector& r,
                                 const Vector& r_dot, const Vector& r_ddot) const noexcept {
    Vector a;
    for (int i = 0; i < N; ++i) {
      const double error = turns_(i) > 0.0 ? std::remainder(r(i) - q(i), turns_(i)) : r(i) - q(i);
      a(i) = r_ddot(i) + damping_(i) * (r_dot(i) - v(i)) + stiffness_(i) * error;
    }
    Vector u;
    if constexpr (requires { mechanism_.voltages(q, v, a); }) {
      u = mechanism_.voltages(q, v, a);
    } else {
      u = mechanism_.forces(q, v, a);
    }
    for (int i = 0; i < N; ++i) {
      u(i) = detail::limited(u(i), -limit_(i), limit_(i));
    }
    return u;
  }

 private:
  Mechanism mechanism_;
  Vector stiffness_;
  Vector damping_;
  Vector limit_;
  Vector turns_ = Vector::Zero();
};

}  // namespace flyball
