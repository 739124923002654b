#include <flyball/mechanisms/drivetrain/robot_body.hpp>

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "core/format.hpp"
#include "core/try.hpp"
#include "mechanisms/motor_checks.hpp"

namespace flyball::mechanisms::detail {

Expected<Shaft> checked_shaft(const DriveShaft& shaft, std::string_view where,
                              std::string_view name, bool may_be_massless) {
  const auto& [motor, gearing, inertia, friction, damping] = shaft;
  const auto of = [&](std::string_view what) {
    return flyball::detail::format("{} of {}", what, name);
  };
  return Checks(where)
      .also([&] { return check_drive(motor, gearing, where, of("the gearing")); })
      .also([&] {
        return may_be_massless
                   ? check_not_negative(inertia.si(), where, of("moment_of_inertia"), "kg m^2")
                   : check_positive(inertia.si(), where, of("moment_of_inertia"), "kg m^2");
      })
      .not_negative(friction, of("friction"), "N m")
      .not_negative(damping, of("damping"), "N m s/rad")
      .map([&] {
        return Shaft{motor.R, motor.Kt, motor.Kv, gearing, inertia.si(), friction, damping};
      });
}

Expected<void> check_body(const RobotBody& body, std::string_view where) {
  return Checks(where)
      .positive(body.mass.si(), "mass", "kg")
      .positive(body.moment_of_inertia.si(), "moment_of_inertia", "kg m^2")
      .finite(body.center_of_mass, "center_of_mass");
}

Expected<void> check_tire(const Tire& tire, std::string_view where) {
  return Checks(where)
      .positive(tire.friction, "the tire's friction")
      .positive(tire.stiffness, "the tire's stiffness")
      .within(tire.shape, 1.0, 2.0, "the tire's shape")
      .positive(tire.rest_speed, "the tire's rest_speed", "m/s");
}

Expected<std::vector<double>> load_shares(std::span<const Eigen::Vector2d> wheels,
                                          const Eigen::Vector2d& center_of_mass,
                                          std::string_view where) {
  const auto count = static_cast<double>(wheels.size());
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    FLYBALL_CHECK(
        check_finite(wheels[i], where, flyball::detail::format("the place of wheel {}", i + 1)));
    middle += wheels[i] / count;
  }
  // Shares 1/n + a·(r_i - r̄) of least squares: Σ (r_i - r̄)(r_i - r̄)ᵀ a = c - r̄.
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& r : wheels) {
    spread += (r - middle) * (r - middle).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
  const double size = std::sqrt(axes.eigenvalues()(1));
  Eigen::Vector2d a = Eigen::Vector2d::Zero();
  double unreached = 0.0;
  for (int k = 0; k < 2; ++k) {
    const double along = axes.eigenvectors().col(k).dot(center_of_mass - middle);
    if (axes.eigenvalues()(k) > 1e-18 * axes.eigenvalues()(1)) {
      a += axes.eigenvectors().col(k) * (along / axes.eigenvalues()(k));
    } else {
      unreached = std::max(unreached, std::abs(along));
    }
  }
  std::vector<double> shares;
  for (const Eigen::Vector2d& r : wheels) {
    shares.push_back(1.0 / count + a.dot(r - middle));
  }
  const double least = shares.empty() ? 0.0 : *std::min_element(shares.begin(), shares.end());
  if (!(least > 0.0) || unreached > 1e-9 * size) {
    return refusal(ArgumentError::out_of_range, where, "center_of_mass")
        .got(flyball::detail::format("({:.4g} m, {:.4g} m), which lifts a wheel", center_of_mass(0),
                                     center_of_mass(1)))
        .expected("between the wheels, so that each of them carries some of the weight")
        .with("least share of the weight on a wheel", least);
  }
  return shares;
}

std::vector<Coordinate> body_coordinates() {
  return {{"x", "m"},
          {"y", "m"},
          {"heading", "rad", true},
          {"forward velocity", "m/s"},
          {"leftward velocity", "m/s"},
          {"angular velocity", "rad/s"}};
}

}  // namespace flyball::mechanisms::detail
