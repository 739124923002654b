#pragma once

#include <cmath>

#include <Eigen/Core>

#include <flyball/geometry/lie_group.hpp>

namespace flyball {

/// A rotation of the plane, kept as (cos θ, sin θ); counter-clockwise, radians. Its tangent is the
/// angle, and the Jacobians are 1. Source: book, section 10.2.2; Sola, Deray, Atchuthan, "A micro
/// Lie theory for state estimation in robotics" (2018), appendix A.
template <class ScalarType>
class SO2 : public LieGroup<SO2<ScalarType>, ScalarType, 1> {
  using Base = LieGroup<SO2<ScalarType>, ScalarType, 1>;

 public:
  using typename Base::Jacobian;
  using typename Base::Scalar;
  using typename Base::Tangent;
  using Point = Eigen::Matrix<Scalar, 2, 1>;
  using Matrix = Eigen::Matrix<Scalar, 2, 2>;

  /// The identity.
  SO2() noexcept : cos_(1.0), sin_(0.0) {}
  /// @param angle  rad, any.
  explicit SO2(const Scalar& angle) noexcept {
    using std::cos, std::sin;
    cos_ = cos(angle);
    sin_ = sin(angle);
  }
  /// @param c, s  A cosine and sine, c² + s² = 1.
  [[nodiscard]] static SO2 from_unit(const Scalar& c, const Scalar& s) noexcept {
    SO2 result;
    result.cos_ = c;
    result.sin_ = s;
    return result;
  }
  /// The direction of (x, y); the identity for (0, 0).
  [[nodiscard]] static SO2 from_direction(const Scalar& x, const Scalar& y) noexcept {
    using std::hypot;
    const Scalar r = hypot(x, y);
    return r > Scalar(0.0) ? from_unit(x / r, y / r) : SO2();
  }
  [[nodiscard]] static SO2 identity() noexcept { return {}; }  ///< 1.

  [[nodiscard]] const Scalar& cos() const noexcept { return cos_; }
  [[nodiscard]] const Scalar& sin() const noexcept { return sin_; }
  /// In [-π, π], rad.
  [[nodiscard]] Scalar angle() const noexcept {
    using std::atan2;
    return atan2(sin_, cos_);
  }
  [[nodiscard]] Matrix matrix() const noexcept {
    Matrix R;
    R << cos_, -sin_, sin_, cos_;
    return R;
  }
  template <class Other>
  [[nodiscard]] SO2<Other> cast() const noexcept {
    return SO2<Other>::from_unit(Other(cos_), Other(sin_));
  }

  /// The product, the sum of the angles; its norm is kept at 1.
  [[nodiscard]] SO2 operator*(const SO2& other) const noexcept {
    const Scalar c = cos_ * other.cos_ - sin_ * other.sin_;
    const Scalar s = sin_ * other.cos_ + cos_ * other.sin_;
    // 1/√n to first order at n = c² + s² = 1
    const Scalar scale = Scalar(1.5) - Scalar(0.5) * (c * c + s * s);
    return from_unit(c * scale, s * scale);
  }
  /// The rotated point.
  [[nodiscard]] Point operator*(const Point& p) const noexcept {
    return {cos_ * p(0) - sin_ * p(1), sin_ * p(0) + cos_ * p(1)};
  }
  [[nodiscard]] SO2 inverse() const noexcept { return from_unit(cos_, -sin_); }

  /// @param theta  rad, any.
  [[nodiscard]] static SO2 exp(const Tangent& theta) noexcept { return SO2(theta(0)); }
  /// In [-π, π].
  [[nodiscard]] Tangent log() const noexcept { return Tangent(angle()); }
  /// 1: rotations of the plane commute.
  [[nodiscard]] Jacobian adjoint() const noexcept { return Jacobian::Identity(); }
  /// 1.
  [[nodiscard]] static Jacobian left_jacobian(const Tangent& /*theta*/) noexcept {
    return Jacobian::Identity();
  }
  /// 1.
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& /*theta*/) noexcept {
    return Jacobian::Identity();
  }

  /// [0, -θ; θ, 0]
  [[nodiscard]] static Matrix hat(const Tangent& theta) noexcept {
    Matrix M = Matrix::Zero();
    M(0, 1) = -theta(0);
    M(1, 0) = theta(0);
    return M;
  }
  /// θ of such a matrix.
  [[nodiscard]] static Tangent vee(const Matrix& M) noexcept { return Tangent(M(1, 0)); }

 private:
  Scalar cos_;
  Scalar sin_;
};

/// A rotation of the plane in doubles.
using Rotation2d = SO2<double>;

}  // namespace flyball
