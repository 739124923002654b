#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <string_view>
#include <utility>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/geometry/so2.hpp>
#include <flyball/mechanisms/kinematics/chassis_speeds.hpp>

namespace flyball::mechanisms {

/// A wheel that rolls in a direction of its own.
struct SwerveModule {
  double speed = 0.0;  ///< m/s; of odometry the distance since the last period, m.
  Rotation2d angle{};  ///< Of its direction in the robot's frame; zero is forward.
};

/// Between the motion of a robot and that of N swerve modules. A module at r moves with v + ω × r;
/// the motion of modules that contradict each other is that of least squares, which for the matrix
/// M of (11.14) is, with the means r̄ and v̄ of the modules' places and velocities,
///
///     ω = Σ (r_i - r̄) × (v_i - v̄)/Σ |r_i - r̄|²,    v = v̄ - ω × r̄.
///
/// Run-time object: noexcept, allocation-free.
template <std::size_t N>
class SwerveKinematics {
 public:
  static constexpr std::size_t module_count = N;
  using Modules = std::array<SwerveModule, N>;
  using Positions = std::array<Eigen::Vector2d, N>;

  /// @param positions  m, not all in one place; `swerve_kinematics` checks it.
  explicit SwerveKinematics(const Positions& positions) noexcept : positions_(positions) {
    for (const auto& r : positions) {
      centroid_ += r / static_cast<double>(N);
    }
    for (const auto& r : positions) {
      spread_ += (r - centroid_).squaredNorm();
    }
  }

  /// Inverse kinematics: the speed and the direction of each module.
  /// @param held    Their angles are kept by modules that stand still, whose direction nothing
  /// says.
  /// @param centre  Of the rotation, m: the point whose speeds are given.
  /// Source: book, equations (11.14) to (11.16).
  [[nodiscard]] Modules modules(
      const ChassisSpeeds& speeds, const Modules& held = {},
      const Eigen::Vector2d& centre = Eigen::Vector2d::Zero()) const noexcept {
    Modules result;
    for (std::size_t i = 0; i < N; ++i) {
      const ChassisSpeeds there = speeds.at(positions_[i] - centre);
      const double square = there.vx * there.vx + there.vy * there.vy;
      // The square of what is tiny or huge has lost digits, or all.
      const double speed =
          square > 1e-280 && square < 1e300 ? std::sqrt(square) : std::hypot(there.vx, there.vy);
      result[i] = {speed, speed > 0.0 ? Rotation2d::from_unit(there.vx / speed, there.vy / speed)
                                      : held[i].angle};
    }
    return result;
  }
  /// Forward kinematics. Source: book, equation (11.17).
  [[nodiscard]] ChassisSpeeds chassis(const Modules& modules) const noexcept {
    std::array<Eigen::Vector2d, N> v;
    for (std::size_t i = 0; i < N; ++i) {
      v[i] = {modules[i].speed * modules[i].angle.cos(), modules[i].speed * modules[i].angle.sin()};
    }
    return chassis(v);
  }
  /// The same of the modules' velocities. @param v  m/s, in the robot's frame.
  [[nodiscard]] ChassisSpeeds chassis(const std::array<Eigen::Vector2d, N>& v) const noexcept {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < N; ++i) {
      mean += v[i] / static_cast<double>(N);
    }
    double moment = 0.0;
    for (std::size_t i = 0; i < N; ++i) {
      const Eigen::Vector2d r = positions_[i] - centroid_;
      const Eigen::Vector2d u = v[i] - mean;
      moment += r(0) * u(1) - r(1) * u(0);
    }
    return ChassisSpeeds{mean(0), mean(1), moment / spread_}.at(-centroid_);
  }
  /// The twist (m, m, rad) in which the modules came a distance each: what odometry adds up.
  [[nodiscard]] Eigen::Vector3d twist(const Modules& distances) const noexcept {
    return chassis(distances).vector();
  }
  /// The covariance of that twist. @param distance_variance  m². @param angle_variance  rad², of
  /// each module's.
  [[nodiscard]] Eigen::Matrix3d twist_covariance(const Modules& distances, double distance_variance,
                                                 double angle_variance) const noexcept {
    Eigen::Matrix3d P = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < N; ++i) {
      const Eigen::Vector2d r = positions_[i] - centroid_;
      const Eigen::Vector2d along(distances[i].angle.cos(), distances[i].angle.sin());
      const Eigen::Vector2d across = distances[i].speed * Eigen::Vector2d(-along(1), along(0));
      for (const auto& [d, variance] :
           {std::pair{along, distance_variance}, std::pair{across, angle_variance}}) {
        const double turn = (r(0) * d(1) - r(1) * d(0)) / spread_;
        const Eigen::Vector3d column =
            ChassisSpeeds{d(0) / N, d(1) / N, turn}.at(-centroid_).vector();
        P += variance * column * column.transpose();
      }
    }
    return P;
  }

  [[nodiscard]] const Positions& positions() const noexcept { return positions_; }

 private:
  Positions positions_;
  Eigen::Vector2d centroid_ = Eigen::Vector2d::Zero();
  double spread_ = 0.0;
};

namespace detail {

/// @errors ArgumentError::not_finite; out_of_range for two modules in one place.
[[nodiscard]] Expected<void> check_module_positions(std::span<const Eigen::Vector2d> positions,
                                                    std::string_view where = "swerve_kinematics");

}  // namespace detail

/// @param positions  m, in the robot's frame; two modules or more.
/// @errors ArgumentError::not_finite; out_of_range for two modules in one place, which no robot has
///         (all in one place say nothing of a rotation). Source: book, section 11.7.
template <std::size_t N>
[[nodiscard]] Expected<SwerveKinematics<N>> swerve_kinematics(
    const std::array<Eigen::Vector2d, N>& positions) {
  static_assert(N >= 2, "one module says nothing of a rotation");
  return detail::check_module_positions(positions).map(
      [&] { return SwerveKinematics<N>(positions); });
}

}  // namespace flyball::mechanisms
