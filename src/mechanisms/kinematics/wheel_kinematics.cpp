#include <flyball/mechanisms/kinematics/wheel_kinematics.hpp>

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::mechanisms {

Expected<DifferentialKinematics> differential_kinematics(Length trackwidth) {
  return Checks("differential_kinematics").positive(trackwidth.si(), "trackwidth", "m").map([&] {
    const double r_b = 0.5 * trackwidth.si();
    // (11.3), (11.4); (11.6), (11.7)
    const Eigen::Matrix<double, 2, 3> M{{1.0, 0.0, -r_b}, {1.0, 0.0, r_b}};
    const Eigen::Matrix<double, 3, 2> F{{0.5, 0.5}, {0.0, 0.0}, {-0.5 / r_b, 0.5 / r_b}};
    return DifferentialKinematics(M, F);
  });
}

Expected<Eigen::MatrixXd> detail::wheel_matrix(std::span<const WheelMount> mounts,
                                               std::string_view where) {
  Eigen::MatrixXd M(static_cast<Eigen::Index>(mounts.size()), 3);
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    const WheelMount& wheel = mounts[static_cast<std::size_t>(i)];
    const std::string name = flyball::detail::format("wheel {}", i + 1);
    FLYBALL_CHECK(Checks(where)
                      .finite(wheel.position, name)
                      .finite(wheel.direction, name)
                      .finite(wheel.roller_angle, name));
    const double grip = std::cos(wheel.roller_angle);  // d·a
    if (!(std::abs(grip) > 1e-3)) {
      return refusal(ArgumentError::out_of_range, where, name)
          .got(flyball::detail::format("with rollers {:.4g} rad from its rolling direction",
                                       wheel.roller_angle))
          .expected("one whose rollers' axis is not across that direction");
    }
    for (Eigen::Index j = 0; j < i; ++j) {
      const WheelMount& other = mounts[static_cast<std::size_t>(j)];
      if (other.position == wheel.position && other.direction == wheel.direction) {
        return refusal(ArgumentError::out_of_range, where, name)
            .got(flyball::detail::format("at ({:.4g} m, {:.4g} m), where wheel {} is",
                                         wheel.position(0), wheel.position(1), j + 1))
            .expected("in a place of its own");
      }
    }
    const double x = std::cos(wheel.direction + wheel.roller_angle) / grip;
    const double y = std::sin(wheel.direction + wheel.roller_angle) / grip;
    M.row(i) << x, y, wheel.position(0) * y - wheel.position(1) * x;
  }
  // About the wheels' middle and over their distances from it: no matter where the origin is, and
  // in which unit.
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const WheelMount& wheel : mounts) {
    middle += wheel.position / static_cast<double>(mounts.size());
  }
  double size = 0.0;
  for (const WheelMount& wheel : mounts) {
    size = std::max(size, (wheel.position - middle).norm());
  }
  Eigen::MatrixXd about_middle = M;
  about_middle.col(2) -= M.col(1) * middle(0) - M.col(0) * middle(1);
  about_middle.col(2) /= size > 0.0 ? size : 1.0;
  const Eigen::VectorXd sigma = about_middle.jacobiSvd().singularValues();
  if (sigma.size() < 3 || !(sigma(2) > 1e-9 * sigma(0))) {
    return refusal(ArgumentError::out_of_range, where, "the layout")
        .got("one that lets some motion of the robot go without any wheel's turning")
        .expected("wheels that see every motion: of three directions or places")
        .with("least of the singular values over the largest",
              sigma.size() < 3 ? 0.0 : sigma(2) / sigma(0));
  }
  return M;
}

Eigen::MatrixXd detail::wheel_pseudo_inverse(const MatrixRef& M) {
  // A change of the unit of ω changes no residual: M⁺ = D (M D)⁺ for full rank.
  const Eigen::Vector3d units(1.0, 1.0, M.leftCols(2).norm() / M.col(2).norm());
  const Eigen::MatrixXd scaled = M * units.asDiagonal();
  return units.asDiagonal() *
         scaled.colPivHouseholderQr().solve(Eigen::MatrixXd::Identity(M.rows(), M.rows()));
}

Expected<MecanumKinematics> mecanum_kinematics(const std::array<Eigen::Vector2d, 4>& positions) {
  constexpr double eighth = 0.78539816339744830962;  // π/4
  return detail::wheel_matrix(std::array{WheelMount{positions[0], 0.0, -eighth},
                                         WheelMount{positions[1], 0.0, eighth},
                                         WheelMount{positions[2], 0.0, eighth},
                                         WheelMount{positions[3], 0.0, -eighth}},
                              "mecanum_kinematics")
      .map([](const Eigen::MatrixXd& M) {
        return MecanumKinematics(M, detail::wheel_pseudo_inverse(M));
      });
}

}  // namespace flyball::mechanisms
