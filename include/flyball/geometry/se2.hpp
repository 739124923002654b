#pragma once

#include <Eigen/Core>

#include <flyball/geometry/so2.hpp>
#include <flyball/geometry/stumpff.hpp>

namespace flyball {

/// A pose of the plane: a rotation and then a translation, in m and rad; x forward, y left, angles
/// counter-clockwise. Tangents (twists) are (vx, vy, ω) in the pose's own frame.
///
///     Exp(v, ω): θ = ω, t = V v with V = [sin θ/θ, -(1 - cos θ)/θ; (1 - cos θ)/θ, sin θ/θ]
///
/// Source: book, Theorem 10.2.1 (the change of pose of a twist is R(θ) V v); Sola, Deray,
/// Atchuthan, "A micro Lie theory for state estimation in robotics" (2018), appendix C.
template <class ScalarType>
class SE2 : public LieGroup<SE2<ScalarType>, ScalarType, 3> {
  using Base = LieGroup<SE2<ScalarType>, ScalarType, 3>;

 public:
  using typename Base::Jacobian;
  using typename Base::Scalar;
  using typename Base::Tangent;
  using Rotation = SO2<Scalar>;
  using Point = Eigen::Matrix<Scalar, 2, 1>;
  using Matrix = Eigen::Matrix<Scalar, 3, 3>;

  /// The identity.
  SE2() noexcept : translation_(Point::Zero()) {}
  SE2(const Point& translation, const Rotation& rotation) noexcept
      : translation_(translation), rotation_(rotation) {}
  /// @param x, y  m. @param angle  rad.
  SE2(const Scalar& x, const Scalar& y, const Scalar& angle) noexcept
      : translation_(x, y), rotation_(angle) {}
  [[nodiscard]] static SE2 identity() noexcept { return {}; }  ///< 1.

  [[nodiscard]] const Point& translation() const noexcept { return translation_; }
  [[nodiscard]] const Rotation& rotation() const noexcept { return rotation_; }
  [[nodiscard]] const Scalar& x() const noexcept { return translation_(0); }
  [[nodiscard]] const Scalar& y() const noexcept { return translation_(1); }
  /// In [-π, π], rad.
  [[nodiscard]] Scalar angle() const noexcept { return rotation_.angle(); }
  /// [R, t; 0, 1]
  [[nodiscard]] Matrix matrix() const noexcept {
    Matrix T = Matrix::Identity();
    T.template topLeftCorner<2, 2>() = rotation_.matrix();
    T.template topRightCorner<2, 1>() = translation_;
    return T;
  }
  template <class Other>
  [[nodiscard]] SE2<Other> cast() const noexcept {
    return {translation_.template cast<Other>(), rotation_.template cast<Other>()};
  }

  [[nodiscard]] SE2 operator*(const SE2& other) const noexcept {
    return {*this * other.translation_, rotation_ * other.rotation_};
  }
  /// R p + t, the point in the frame in which the pose is.
  [[nodiscard]] Point operator*(const Point& p) const noexcept {
    return rotation_ * p + translation_;
  }
  [[nodiscard]] SE2 inverse() const noexcept {
    const Rotation back = rotation_.inverse();
    return {-(back * translation_), back};
  }

  /// The pose exponential. @param tau  (vx, vy, ω): where a constant twist leads in one unit of
  /// time.
  [[nodiscard]] static SE2 exp(const Tangent& tau) noexcept {
    const Arc arc(tau(2));
    return {arc.V(tau.template head<2>()), arc.rotation};
  }
  /// The twist of it, ω in [-π, π].
  [[nodiscard]] Tangent log() const noexcept {
    const Scalar theta = angle();
    const Point v = Arc(theta, rotation_).V_inverse(translation_);
    return {v(0), v(1), theta};
  }
  /// [R, (y, -x)ᵀ; 0, 1]: X Exp(τ) X⁻¹ = Exp(Ad τ).
  [[nodiscard]] Jacobian adjoint() const noexcept {
    Jacobian Ad = Jacobian::Identity();
    Ad.template topLeftCorner<2, 2>() = rotation_.matrix();
    Ad(0, 2) = y();
    Ad(1, 2) = -x();
    return Ad;
  }
  /// Sola et al. (2018), equation (164).
  [[nodiscard]] static Jacobian left_jacobian(const Tangent& tau) noexcept {
    const Arc arc(tau(2));
    const Point w = arc.turned(tau.template head<2>());
    Jacobian J = Jacobian::Identity();
    J(0, 0) = J(1, 1) = arc.c_1;
    J(1, 0) = arc.theta * arc.c_2;
    J(0, 1) = -J(1, 0);
    J(0, 2) = w(0);
    J(1, 2) = w(1);
    return J;
  }
  /// Its inverse; singular at whole turns.
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& tau) noexcept {
    const Arc arc(tau(2));
    const Point w = arc.V_inverse(arc.turned(tau.template head<2>()));
    Jacobian J = Jacobian::Identity();
    J(0, 0) = J(1, 1) = arc.half_cotangent();
    J(0, 1) = Scalar(0.5) * arc.theta;
    J(1, 0) = -J(0, 1);
    J(0, 2) = -w(0);
    J(1, 2) = -w(1);
    return J;
  }

  /// [0, -ω, vx; ω, 0, vy; 0, 0, 0]
  [[nodiscard]] static Matrix hat(const Tangent& tau) noexcept {
    Matrix M = Matrix::Zero();
    M(0, 1) = -tau(2);
    M(1, 0) = tau(2);
    M(0, 2) = tau(0);
    M(1, 2) = tau(1);
    return M;
  }
  /// (vx, vy, ω) of such a matrix.
  [[nodiscard]] static Tangent vee(const Matrix& M) noexcept { return {M(0, 2), M(1, 2), M(1, 0)}; }

 private:
  /// What V is made of.
  struct Arc {
    Scalar theta;
    Scalar c_1;  ///< sin θ/θ
    Scalar c_2;  ///< (1 - cos θ)/θ²
    Rotation rotation;

    explicit Arc(const Scalar& angle) noexcept : theta(angle) {
      const Scalar s = theta * theta;
      if (s < Scalar(detail::stumpff_series_below<1>)) {
        series(s);
        rotation = Rotation::from_unit(Scalar(1.0) - s * c_2, theta * c_1);
      } else {
        rotation = Rotation(theta);
        closed(s);
      }
    }
    /// With the cosine and sine known.
    Arc(const Scalar& angle, const Rotation& known) noexcept : theta(angle), rotation(known) {
      const Scalar s = theta * theta;
      if (s < Scalar(detail::stumpff_series_below<1>)) {
        series(s);
      } else {
        closed(s);
      }
    }
    void series(const Scalar& s) noexcept {
      c_1 = detail::stumpff<1>(s);
      c_2 = detail::stumpff<2>(s);
    }
    void closed(const Scalar& s) noexcept {
      c_1 = rotation.sin() / theta;
      c_2 = (Scalar(1.0) - rotation.cos()) / s;
    }

    [[nodiscard]] Point V(const Point& v) const noexcept {
      const Scalar b = theta * c_2;
      return {c_1 * v(0) - b * v(1), b * v(0) + c_1 * v(1)};
    }
    /// (θ/2) cot(θ/2)
    [[nodiscard]] Scalar half_cotangent() const noexcept { return c_1 / (c_2 + c_2); }
    [[nodiscard]] Point V_inverse(const Point& t) const noexcept {
      const Scalar a = half_cotangent();
      const Scalar b = Scalar(0.5) * theta;
      return {a * t(0) + b * t(1), a * t(1) - b * t(0)};
    }
    /// How the translation turns with θ, the last column of the left Jacobian:
    /// (θ - sin θ)/θ² v + (1 - cos θ)/θ² (v_y, -v_x).
    [[nodiscard]] Point turned(const Point& v) const noexcept {
      const Scalar a = theta * detail::stumpff<3>(Scalar(theta * theta));
      return {a * v(0) + c_2 * v(1), a * v(1) - c_2 * v(0)};
    }
  };

  Point translation_;
  Rotation rotation_;
};

/// A pose of the plane in doubles.
using Pose2d = SE2<double>;

}  // namespace flyball
