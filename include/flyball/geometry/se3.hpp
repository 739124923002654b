#pragma once

#include <Eigen/Core>

#include <flyball/geometry/so3.hpp>

namespace flyball {

/// A pose of space: a rotation and then a translation, in m and rad; x forward, y left, z up.
/// Tangents (twists) are (v, ω) in the pose's own frame, translation first.
///
///     Exp(v, ω) = (Jl(ω) v, Exp(ω))
///
/// Source: Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics" (2018),
/// appendix D; Barfoot, "State Estimation for Robotics" (2017), section 7.1.
template <class ScalarType>
class SE3 : public LieGroup<SE3<ScalarType>, ScalarType, 6> {
  using Base = LieGroup<SE3<ScalarType>, ScalarType, 6>;

 public:
  using typename Base::Jacobian;
  using typename Base::Scalar;
  using typename Base::Tangent;
  using Rotation = SO3<Scalar>;
  using Point = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix = Eigen::Matrix<Scalar, 4, 4>;

  /// The identity.
  SE3() noexcept : translation_(Point::Zero()) {}
  SE3(const Point& translation, const Rotation& rotation) noexcept
      : translation_(translation), rotation_(rotation) {}
  [[nodiscard]] static SE3 identity() noexcept { return {}; }  ///< 1.

  [[nodiscard]] const Point& translation() const noexcept { return translation_; }
  [[nodiscard]] const Rotation& rotation() const noexcept { return rotation_; }
  [[nodiscard]] const Scalar& x() const noexcept { return translation_(0); }
  [[nodiscard]] const Scalar& y() const noexcept { return translation_(1); }
  [[nodiscard]] const Scalar& z() const noexcept { return translation_(2); }
  /// [R, t; 0, 1]
  [[nodiscard]] Matrix matrix() const noexcept {
    Matrix T = Matrix::Identity();
    T.template topLeftCorner<3, 3>() = rotation_.matrix();
    T.template topRightCorner<3, 1>() = translation_;
    return T;
  }
  template <class Other>
  [[nodiscard]] SE3<Other> cast() const noexcept {
    return {translation_.template cast<Other>(), rotation_.template cast<Other>()};
  }

  [[nodiscard]] SE3 operator*(const SE3& other) const noexcept {
    return {*this * other.translation_, rotation_ * other.rotation_};
  }
  /// R p + t, the point in the frame in which the pose is.
  [[nodiscard]] Point operator*(const Point& p) const noexcept {
    return rotation_ * p + translation_;
  }
  [[nodiscard]] SE3 inverse() const noexcept {
    const Rotation back = rotation_.inverse();
    return {-(back * translation_), back};
  }

  [[nodiscard]] static SE3 exp(const Tangent& tau) noexcept {
    const Point omega = tau.template tail<3>();
    return {Rotation::left_jacobian(omega) * tau.template head<3>(), Rotation::exp(omega)};
  }
  /// The twist of it, |ω| in [0, π].
  [[nodiscard]] Tangent log() const noexcept {
    const Point omega = rotation_.log();
    Tangent tau;
    tau << Rotation::left_jacobian_inverse(omega) * translation_, omega;
    return tau;
  }
  /// [R, [t]× R; 0, R]: X Exp(τ) X⁻¹ = Exp(Ad τ).
  [[nodiscard]] Jacobian adjoint() const noexcept {
    const auto R = rotation_.matrix();
    return blocks(R, Rotation::hat(translation_) * R);
  }
  /// [J, Q; 0, J] with the J of the rotation. Barfoot (2017), equations (7.85) and (7.86).
  [[nodiscard]] static Jacobian left_jacobian(const Tangent& tau) noexcept {
    return blocks(Rotation::left_jacobian(tau.template tail<3>()), Q(tau));
  }
  /// [J⁻¹, -J⁻¹ Q J⁻¹; 0, J⁻¹]
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& tau) noexcept {
    const Block J = Rotation::left_jacobian_inverse(tau.template tail<3>());
    return blocks(J, -J * Q(tau) * J);
  }

  /// [[ω]×, v; 0, 0]
  [[nodiscard]] static Matrix hat(const Tangent& tau) noexcept {
    Matrix M = Matrix::Zero();
    M.template topLeftCorner<3, 3>() = Rotation::hat(tau.template tail<3>());
    M.template topRightCorner<3, 1>() = tau.template head<3>();
    return M;
  }
  /// (v, ω) of such a matrix.
  [[nodiscard]] static Tangent vee(const Matrix& M) noexcept {
    Tangent tau;
    tau << M.template topRightCorner<3, 1>(), Rotation::vee(M.template topLeftCorner<3, 3>());
    return tau;
  }

 private:
  using Block = Eigen::Matrix<Scalar, 3, 3>;

  /// [D, U; 0, D]
  [[nodiscard]] static Jacobian blocks(const Block& D, const Block& U) noexcept {
    Jacobian J;
    J << D, U, Block::Zero(), D;
    return J;
  }
  /// With c_4 = (θ²/2 - 1 + cos θ)/θ⁴ and c_5 = (θ³/6 - θ + sin θ)/θ⁵; Barfoot (2017), (7.86).
  [[nodiscard]] static Block Q(const Tangent& tau) noexcept {
    const Block V = Rotation::hat(tau.template head<3>());
    const Block W = Rotation::hat(tau.template tail<3>());
    const Scalar s = tau.template tail<3>().squaredNorm();
    const Scalar c_3 = detail::stumpff<3>(s);
    const Scalar c_4 = detail::stumpff<4>(s);
    const Scalar c_5 = detail::stumpff<5>(s);
    const Block WV = W * V;
    const Block VW = V * W;
    const Block WVW = WV * W;
    return Scalar(0.5) * V + c_3 * (WV + VW + WVW) + c_4 * (W * WV + VW * W - Scalar(3.0) * WVW) +
           Scalar(0.5) * (c_4 - Scalar(3.0) * c_5) * (WVW * W + W * WVW);
  }

  Point translation_;
  Rotation rotation_;
};

/// A pose of space in doubles.
using Pose3d = SE3<double>;

}  // namespace flyball
