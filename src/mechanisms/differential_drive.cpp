#include <flyball/mechanisms/differential_drive.hpp>

#include <cmath>

#include "core/try.hpp"
#include "mechanisms/motor_checks.hpp"

namespace flyball::mechanisms {

namespace {

constexpr std::string_view in_differential_drive = "differential_drive";

Expected<DifferentialDrive> finite(DifferentialDrive drive) {
  FLYBALL_CHECK(check_finite(drive.A, in_differential_drive, "A"));
  FLYBALL_CHECK(check_finite(drive.B, in_differential_drive, "B"));
  return drive;
}

DifferentialDrive measured_velocities() {
  DifferentialDrive drive;
  drive.C = Eigen::Matrix2d::Identity();
  drive.D = Eigen::Matrix2d::Zero();
  return drive;
}

Expected<void> check_gains(const DriveGains& gains) {
  return Checks(in_differential_drive)
      .positive(gains.kV_linear, "kV_linear", "V s/m")
      .positive(gains.kA_linear, "kA_linear", "V s^2/m")
      .positive(gains.kV_angular, "kV_angular", "V s/m")
      .positive(gains.kA_angular, "kA_angular", "V s^2/m")
      .not_negative(gains.kS_left, "kS_left", "V")
      .not_negative(gains.kS_right, "kS_right", "V");
}

}  // namespace

ModelDescription DifferentialDrive::description() const {
  ModelDescription description{.name = "differential drive",
                               .states = {{"left velocity", "m/s"}, {"right velocity", "m/s"}},
                               .inputs = {{"left voltage", "V"}, {"right voltage", "V"}}};
  description.outputs = description.states;
  return description;
}

Expected<DifferentialDrive> differential_drive(const DifferentialDriveParameters& parameters) {
  const auto& [motor, G_l, G_r, mass, wheel_radius, trackwidth, moment_of_inertia] = parameters;
  const double m = mass.si();
  const double r = wheel_radius.si();
  const double r_b = 0.5 * trackwidth.si();
  const double J = moment_of_inertia.si();
  FLYBALL_CHECK(
      Checks(in_differential_drive)
          .also([&] { return check_drive(motor, G_l, in_differential_drive, "left_gearing"); })
          .also([&] { return check_drive(motor, G_r, in_differential_drive, "right_gearing"); })
          .positive(m, "mass", "kg")
          .positive(r, "wheel_radius", "m")
          .positive(trackwidth.si(), "trackwidth", "m")
          .positive(J, "moment_of_inertia", "kg m^2"));
  const double R = motor.R;
  const double Kt = motor.Kt;
  const double Kv = motor.Kv;
  // F_l = C_1 v_l + C_2 V_l (12.29), F_r = C_3 v_r + C_4 V_r (12.30).
  const double C_1 = -G_l * G_l * Kt / (Kv * R * r * r);
  const double C_2 = G_l * Kt / (R * r);
  const double C_3 = -G_r * G_r * Kt / (Kv * R * r * r);
  const double C_4 = G_r * Kt / (R * r);
  const double p = 1.0 / m + r_b * r_b / J;
  const double q = 1.0 / m - r_b * r_b / J;
  DifferentialDrive drive = measured_velocities();
  drive.A << p * C_1, q * C_3, q * C_1, p * C_3;  // (8.7)
  drive.B << p * C_2, q * C_4, q * C_2, p * C_4;  // (8.8)
  drive.nominal_voltage = motor.nominal_voltage;
  return finite(drive);
}

Expected<DifferentialDrive> differential_drive(const DriveGains& gains) {
  FLYBALL_CHECK(check_gains(gains));
  const double straight = gains.kV_linear / gains.kA_linear;
  const double turning = gains.kV_angular / gains.kA_angular;
  const double A_1 = -0.5 * (straight + turning);  // (14.12)
  const double A_2 = -0.5 * (straight - turning);
  const double B_1 = 0.5 * (1.0 / gains.kA_linear + 1.0 / gains.kA_angular);
  const double B_2 = 0.5 * (1.0 / gains.kA_linear - 1.0 / gains.kA_angular);
  DifferentialDrive drive = measured_velocities();
  drive.A << A_1, A_2, A_2, A_1;
  drive.B << B_1, B_2, B_2, B_1;
  drive.kS_left = gains.kS_left;
  drive.kS_right = gains.kS_right;
  return finite(drive);
}

Expected<DriveGains> drive_gains(const DifferentialDrive& drive) {
  constexpr std::string_view here = "drive_gains";
  FLYBALL_CHECK(check_system(drive, here));
  constexpr double alike = 1e-9;
  const auto differ = [](const Eigen::Matrix2d& M) {
    return std::abs(M(0, 0) - M(1, 1)) > alike * M.norm() ||
           std::abs(M(0, 1) - M(1, 0)) > alike * M.norm();
  };
  if (differ(drive.A) || differ(drive.B)) {
    return refusal(ArgumentError::out_of_range, here, differ(drive.A) ? "A" : "B")
        .got("different left and right sides")
        .expected("[a, b; b, a]")
        .hint("gains of a linear and an angular mode belong to a drive of like sides");
  }
  // Modes: half the sum and half the difference of the sides.
  const double straight_B = drive.B(0, 0) + drive.B(0, 1);
  const double turning_B = drive.B(0, 0) - drive.B(0, 1);
  const DriveGains gains{.kS_left = drive.kS_left,
                         .kS_right = drive.kS_right,
                         .kV_linear = -(drive.A(0, 0) + drive.A(0, 1)) / straight_B,
                         .kA_linear = 1.0 / straight_B,
                         .kV_angular = -(drive.A(0, 0) - drive.A(0, 1)) / turning_B,
                         .kA_angular = 1.0 / turning_B};
  FLYBALL_CHECK(check_gains(gains));
  return gains;
}

Expected<ContinuousSystem<3, 2, 3>> heading_drive(const DifferentialDrive& drive,
                                                  Length trackwidth) {
  constexpr std::string_view here = "heading_drive";
  FLYBALL_CHECK(check_system(drive, here));
  const double width = trackwidth.si();
  FLYBALL_CHECK(check_positive(width, here, "trackwidth", "m"));
  ContinuousSystem<3, 2, 3> system;
  system.A.setZero();
  system.A.row(0) << 0.0, -1.0 / width, 1.0 / width;  // (8.9)
  system.A.bottomRightCorner<2, 2>() = drive.A;
  system.B.setZero();
  system.B.bottomRows<2>() = drive.B;  // (8.10)
  system.C.setIdentity();
  system.D.setZero();
  return system;
}

Expected<ContinuousSystem<2, 2, 2>> linear_angular_drive(const DriveGains& gains,
                                                         Length trackwidth) {
  const double half = 0.5 * trackwidth.si();
  FLYBALL_CHECK(check_gains(gains));
  FLYBALL_CHECK(check_positive(trackwidth.si(), "linear_angular_drive", "trackwidth", "m"));
  const double kA_angular = half * gains.kA_angular;
  ContinuousSystem<2, 2, 2> system;
  system.A << -gains.kV_linear / gains.kA_linear, 0.0, 0.0, -gains.kV_angular / gains.kA_angular;
  system.B << 0.5 / gains.kA_linear, 0.5 / gains.kA_linear, -0.5 / kA_angular, 0.5 / kA_angular;
  system.C.setIdentity();
  system.D.setZero();
  return system;
}

Expected<MomentOfInertia> moment_of_inertia(const DriveGains& gains, Mass mass, Length trackwidth) {
  return Checks("moment_of_inertia")
      .positive(gains.kA_linear, "kA_linear", "V s^2/m")
      .positive(gains.kA_angular, "kA_angular", "V s^2/m")
      .positive(mass.si(), "mass", "kg")
      .positive(trackwidth.si(), "trackwidth", "m")
      .map([&] {
        const double r_b = 0.5 * trackwidth.si();
        return MomentOfInertia(mass.si() * r_b * r_b * gains.kA_angular / gains.kA_linear);
      });
}

}  // namespace flyball::mechanisms
