#pragma once

#include <cmath>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/geometry/lie_group.hpp>
#include <flyball/geometry/stumpff.hpp>

namespace flyball {

/// A rotation of space, kept as a unit quaternion (w, x, y, z); q and -q are the same rotation. Its
/// tangent is the rotation vector φ = θ a, about the axis a by θ, rad.
///
///     Exp(φ) = (cos(θ/2), sin(θ/2) a),    Log(q) = 2 atan2(|v|, w) v/|v|
///
/// Source: Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics" (2018),
/// appendix B; Barfoot, "State Estimation for Robotics" (2017), section 7.1.
template <class ScalarType>
class SO3 : public LieGroup<SO3<ScalarType>, ScalarType, 3> {
  using Base = LieGroup<SO3<ScalarType>, ScalarType, 3>;

 public:
  using typename Base::Jacobian;
  using typename Base::Scalar;
  using typename Base::Tangent;
  using Point = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix = Eigen::Matrix<Scalar, 3, 3>;
  using Quaternion = Eigen::Matrix<Scalar, 4, 1>;

  /// The identity.
  SO3() noexcept : q_(Quaternion::Unit(0)) {}
  /// @param q  (w, x, y, z) of norm 1; `rotation_from_quaternion` takes any.
  [[nodiscard]] static SO3 from_unit(const Quaternion& q) noexcept {
    SO3 result;
    result.q_ = q;
    return result;
  }
  [[nodiscard]] static SO3 identity() noexcept { return {}; }  ///< 1.

  /// (w, x, y, z), of norm 1.
  [[nodiscard]] const Quaternion& quaternion() const noexcept { return q_; }
  [[nodiscard]] Matrix matrix() const noexcept {
    // I + 2 w [v]× + 2 [v]×²
    const Matrix V = hat(q_.template tail<3>());
    return Matrix::Identity() + Scalar(2.0) * (q_(0) * V + V * V);
  }
  template <class Other>
  [[nodiscard]] SO3<Other> cast() const noexcept {
    return SO3<Other>::from_unit(q_.template cast<Other>());
  }

  /// The product: first the other rotation, then this one. Its norm is kept at 1.
  [[nodiscard]] SO3 operator*(const SO3& other) const noexcept {
    const Quaternion& p = other.q_;
    Quaternion r;
    r << q_(0) * p(0) - q_(1) * p(1) - q_(2) * p(2) - q_(3) * p(3),
        q_(0) * p(1) + q_(1) * p(0) + q_(2) * p(3) - q_(3) * p(2),
        q_(0) * p(2) + q_(2) * p(0) + q_(3) * p(1) - q_(1) * p(3),
        q_(0) * p(3) + q_(3) * p(0) + q_(1) * p(2) - q_(2) * p(1);
    // 1/√n to first order at n = |r|² = 1
    const Scalar scale = Scalar(1.5) - Scalar(0.5) * r.squaredNorm();
    return from_unit(r * scale);
  }
  /// The rotated point.
  [[nodiscard]] Point operator*(const Point& p) const noexcept {
    const Point v = q_.template tail<3>();
    const Point t = Scalar(2.0) * cross(v, p);
    return p + q_(0) * t + cross(v, t);
  }
  [[nodiscard]] SO3 inverse() const noexcept { return from_unit({q_(0), -q_(1), -q_(2), -q_(3)}); }

  /// @param phi  rad, any length.
  [[nodiscard]] static SO3 exp(const Tangent& phi) noexcept {
    const Scalar s = Scalar(0.25) * phi.squaredNorm();  // (θ/2)²
    const Scalar half_sinc = Scalar(0.5) * detail::stumpff<1>(s);
    return from_unit(
        {detail::stumpff<0>(s), half_sinc * phi(0), half_sinc * phi(1), half_sinc * phi(2)});
  }
  /// The shortest rotation vector, θ in [0, π].
  [[nodiscard]] Tangent log() const noexcept {
    using std::atan2, std::sqrt;
    const Quaternion q = q_(0) < Scalar(0.0) ? Quaternion(-q_) : q_;
    const Scalar& w = q(0);
    const Point v = q.template tail<3>();
    const Scalar n2 = v.squaredNorm();
    if (n2 < static_cast<Scalar>(0.01) * w * w) {
      // atan(r)/r = Σ (-r²)^k/(2k + 1) at r = |v|/w < 0.1; the ninth term is 6e-18.
      const Scalar r2 = n2 / (w * w);
      Scalar sum = static_cast<Scalar>(1.0 / 15.0);
      for (int k = 6; k >= 0; --k) {
        sum = static_cast<Scalar>(1.0 / (2.0 * k + 1.0)) - r2 * sum;
      }
      return v * (Scalar(2.0) * sum / w);
    }
    const Scalar n = sqrt(n2);
    return v * (Scalar(2.0) * atan2(n, w) / n);
  }
  /// R.
  [[nodiscard]] Jacobian adjoint() const noexcept { return matrix(); }
  /// I + (1 - cos θ)/θ² [φ]× + (θ - sin θ)/θ³ [φ]×². Barfoot (2017), equation (7.77).
  [[nodiscard]] static Jacobian left_jacobian(const Tangent& phi) noexcept {
    const Scalar s = phi.squaredNorm();
    const Matrix K = hat(phi);
    return Jacobian::Identity() + detail::stumpff<2>(s) * K + detail::stumpff<3>(s) * (K * K);
  }
  /// I - [φ]×/2 + (1 - (θ/2) cot(θ/2))/θ² [φ]×². Barfoot (2017), equation (7.76).
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& phi) noexcept {
    const Matrix K = hat(phi);
    return Jacobian::Identity() - Scalar(0.5) * K +
           detail::inverse_jacobian_coefficient<Scalar>(phi.squaredNorm()) * (K * K);
  }

  /// [φ]×, the matrix of the cross product with φ.
  [[nodiscard]] static Matrix hat(const Tangent& phi) noexcept {
    Matrix M = Matrix::Zero();
    M(2, 1) = phi(0);
    M(1, 2) = -phi(0);
    M(0, 2) = phi(1);
    M(2, 0) = -phi(1);
    M(1, 0) = phi(2);
    M(0, 1) = -phi(2);
    return M;
  }
  /// φ of such a matrix.
  [[nodiscard]] static Tangent vee(const Matrix& M) noexcept { return {M(2, 1), M(0, 2), M(1, 0)}; }

 private:
  [[nodiscard]] static Point cross(const Point& a, const Point& b) noexcept {
    return {a(1) * b(2) - a(2) * b(1), a(2) * b(0) - a(0) * b(2), a(0) * b(1) - a(1) * b(0)};
  }

  Quaternion q_;
};

/// A rotation of space in doubles.
using Rotation3d = SO3<double>;

/// The rotation of a quaternion of any length but zero.
/// @errors ArgumentError::not_finite, out_of_range for a length of zero.
[[nodiscard]] Expected<Rotation3d> rotation_from_quaternion(double w, double x, double y, double z);

/// The rotation of a matrix. @param R  3 x 3, |RᵀR - I| <= 1e-6 in each entry, det R > 0; what is
/// nearly a rotation gives the nearest one to first order.
/// @errors ArgumentError::not_finite, out_of_range for what is none.
/// Source: Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1 (1978).
[[nodiscard]] Expected<Rotation3d> rotation_from_matrix(const Eigen::Matrix3d& R);

}  // namespace flyball
