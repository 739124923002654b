#include <flyball/study/design_holonomic.hpp>

#include <cmath>
#include <complex>

#include <fmt/format.h>

#include <flyball/export/holonomic_follower.hpp>
#include <flyball/study/project.hpp>

#include "core/try.hpp"
#include "study/holonomic_law.hpp"

namespace flyball::study {

namespace {

/// Of a 2 x 2 matrix.
Eigen::Vector2cd eigenvalues_of(const Eigen::Matrix2d& M) {
  const double half = 0.5 * M.trace();
  const double determinant = M(0, 0) * M(1, 1) - M(0, 1) * M(1, 0);
  const std::complex<double> root = std::sqrt(std::complex<double>(half * half - determinant));
  return {half + root, half - root};
}

}  // namespace

Expected<HolonomicDesign> design_holonomic(const DriveJob& job) {
  if (job.robot.kind == DriveKind::differential || job.follower != DriveFollower::holonomic) {
    const bool sides = job.robot.kind == DriveKind::differential;
    return tl::unexpected(
        Error(ProjectError::wrong_value)
            .in(job.path)
            .about(sides ? "drive.type" : "drive.follower")
            .got(fmt::format("\"{}\"", sides ? to_string(job.robot.kind) : to_string(job.follower)))
            .expected(sides ? "\"swerve\" or \"mecanum\"" : "\"holonomic\"")
            .hint(sides ? "" : "pure pursuit has no gains; `flyball drive` simulates it"));
  }
  HolonomicDesign design{.job = job, .diagnostics = job.diagnostics};
  FLYBALL_TRY(const auto parts, holonomic_parts(job));
  const DriveRobot& robot = job.robot;
  design.gains = parts.follower.gains();
  design.kS = parts.wheel.kS;
  design.kV = robot.gearing / (robot.motor.Kv * robot.wheel_radius);
  design.kA = robot.motor.R * robot.wheel_radius * 0.25 * rolling_mass(robot, 4) /
              (robot.gearing * robot.motor.Kt);
  design.A = parts.wheel.A;
  design.B = parts.wheel.B;
  design.kP = parts.wheel.K;
  design.pole = design.A - design.B * design.kP;
  const SpinningWheel spinning = SpinningWheel::of(robot, job.period);
  design.spinning_A = spinning.a;
  design.spinning_B = spinning.b;
  design.spinning_pole = spinning.pole(design.kP);
  exports::HolonomicProgram program{.swerve = robot.kind == DriveKind::swerve,
                                    .period = job.period,
                                    .gains = design.gains,
                                    .max_velocity = parts.follower.settings().limits.velocity,
                                    .max_wheel_velocity = parts.fastest,
                                    .modules = robot.modules,
                                    .M = parts.M,
                                    .A = design.A,
                                    .B = design.B,
                                    .K = design.kP,
                                    .kS = design.kS,
                                    .voltage_limit = job.max_voltage,
                                    .creep = creep};
  if (program.swerve) {
    design.steer = parts.steer;
    design.steer_A = parts.steer_A;
    design.steer_B = parts.steer_B;
    design.steer_poles = eigenvalues_of(parts.steer_A - parts.steer_B * parts.steer);
    design.steer_kV = robot.steer_gearing / robot.steer_motor.Kv;
    design.steer_kA =
        robot.steer_motor.R * robot.steer_inertia / (robot.steer_gearing * robot.steer_motor.Kt);
    program.steer = parts.steer;
  }
  design.header = exports::holonomic_follower_header(program, job.path);
  return design;
}

}  // namespace flyball::study
