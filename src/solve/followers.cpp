#include <cmath>
#include <utility>
#include <vector>

#include <flyball/control/followers/holonomic.hpp>
#include <flyball/control/followers/ltv_drive.hpp>
#include <flyball/control/followers/ltv_unicycle.hpp>
#include <flyball/control/followers/pure_pursuit.hpp>
#include <flyball/control/followers/ramsete.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// What follows a path or a trajectory.
namespace flyball::solve {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

Pose2d pose_of(const Problem& problem, std::string_view name) {
  const MatrixXd& values = problem.matrix(name);
  return {values(0, 0), values(1, 0), values(2, 0)};
}

TrackingPoint reference_of(const Problem& problem) {
  return {pose_of(problem, "reference"),
          {problem.number("v"), problem.has("vy") ? problem.number("vy") : 0.0,
           problem.number("omega")}};
}

Outcome solve_ramsete(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto follower,
              RamseteFollower::create({.b = problem.number("b"), .zeta = problem.number("zeta")}));
  const Pose2d pose = pose_of(problem, "pose");
  const TrackingPoint r = reference_of(problem);
  const FollowerCommand command = follower.calculate(pose, r);
  const Eigen::Vector3d error = tracking_error(pose, r.pose);
  answer.add("v", command.speeds.vx);
  answer.add("omega", command.speeds.omega);
  answer.add("pose_error", VectorXd(error));
  answer.add("V", follower.lyapunov(error));
  answer.add("V_rate", follower.lyapunov_rate(error, r));
  return {};
}

Outcome solve_ltv_unicycle(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto follower,
              LtvUnicycleFollower::create(
                  {.x_tolerance = problem.number("x_tolerance"),
                   .y_tolerance = problem.number("y_tolerance"),
                   .heading_tolerance = problem.number("heading_tolerance"),
                   .velocity_tolerance = problem.number("velocity_tolerance"),
                   .angular_velocity_tolerance = problem.number("angular_velocity_tolerance"),
                   .period = Time(problem.number("T"))}));
  answer.add("K", MatrixXd(follower.K(problem.number("v"))));
  return {};
}

Outcome solve_ltv_drive(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto drive, mechanisms::differential_drive(mechanisms::DriveGains{
                                    .kV_linear = problem.number("kV"),
                                    .kA_linear = problem.number("kA"),
                                    .kV_angular = problem.number("kV_angular"),
                                    .kA_angular = problem.number("kA_angular")}));
  const Length trackwidth(problem.number("trackwidth"));
  FLYBALL_TRY(const auto follower,
              LtvDriveFollower::create(drive, trackwidth,
                                       {.x_tolerance = problem.number("x_tolerance"),
                                        .y_tolerance = problem.number("y_tolerance"),
                                        .heading_tolerance = problem.number("heading_tolerance"),
                                        .velocity_tolerance = problem.number("velocity_tolerance"),
                                        .voltage_tolerance = problem.number("voltage_tolerance"),
                                        .period = Time(problem.number("T"))}));
  const double v = problem.number("v");
  FLYBALL_TRY(const auto model, drive_error_dynamics(drive, trackwidth, v));
  answer.add("K", MatrixXd(follower.K(v)));
  answer.add("A", MatrixXd(model.A));
  answer.add("B", MatrixXd(model.B));
  return {};
}

Outcome solve_holonomic(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(auto follower,
              HolonomicFollower::create(
                  {.x_tolerance = problem.number("x_tolerance"),
                   .y_tolerance = problem.number("y_tolerance"),
                   .heading_tolerance = problem.number("heading_tolerance"),
                   .velocity_tolerance = problem.number("velocity_tolerance"),
                   .angular_velocity_tolerance = problem.number("angular_velocity_tolerance"),
                   .period = Time(problem.number("T"))}));
  answer.add("gains", VectorXd(follower.gains()));
  const FollowerCommand command =
      follower.calculate(pose_of(problem, "pose"), reference_of(problem));
  answer.add("vx", command.speeds.vx);
  answer.add("vy", command.speeds.vy);
  answer.add("omega", command.speeds.omega);
  return {};
}

Outcome solve_pure_pursuit(const Problem& problem, JsonWriter& answer) {
  const MatrixXd& path = problem.matrix("path");
  std::vector<PathPoint> points;
  for (Eigen::Index i = 0; i < path.rows(); ++i) {
    points.push_back({Pose2d(path(i, 0), path(i, 1), path(i, 2)), 0.0});
  }
  const double lookahead = problem.number("lookahead");
  FLYBALL_TRY(auto follower,
              PurePursuitFollower::create(points, {.velocity = problem.number("v"),
                                                   .least_lookahead = lookahead,
                                                   .largest_lookahead = lookahead,
                                                   .lookahead_time = 0.0,
                                                   .tolerance = problem.number("tolerance")}));
  const FollowerCommand command = follower.calculate(pose_of(problem, "pose"));
  answer.add("v", command.speeds.vx);
  answer.add("omega", command.speeds.omega);
  answer.add("curvature", follower.curvature());
  answer.add("target", VectorXd(follower.target()));
  answer.add("cross_track", follower.cross_track());
  answer.add("progress", follower.progress());
  answer.add("arrived", follower.arrived());
  return {};
}

}  // namespace

std::vector<Kind> follower_kinds() {
  using namespace field;
  const Field pose = list("pose", "3", "", "where the robot is: x (m), y (m), heading (rad)");
  const Field reference = list("reference", "3", "", "where it is to be: x, y, heading");
  const Field v = number("v", "m/s", "the reference's velocity, ahead");
  const Field vy = or_number(number("vy", "m/s", "the reference's velocity to its left"), 0.0);
  const Field omega = number("omega", "rad/s", "the reference's turning");
  const Field K_v = number("v", "m/s", "the velocity at which it is");
  const Field T = or_number(period, 0.02);
  const auto tolerance = [](std::string_view name, std::string_view unit, double usual,
                            std::string_view help) {
    return or_number(number(name, unit, help), usual);
  };
  const Field speed = tolerance("velocity_tolerance", "m/s", 1.0, "Bryson's, of the velocity");
  const Field turning =
      tolerance("angular_velocity_tolerance", "rad/s", 2.0, "Bryson's, of the turning");
  const Field ahead = tolerance("x_tolerance", "m", 0.0625, "Bryson's, ahead");
  const Field across = tolerance("y_tolerance", "m", 0.125, "Bryson's, across");
  const Field heading = tolerance("heading_tolerance", "rad", 2.5, "Bryson's, of the heading");
  return {
      {"ramsete",
       "a period of Ramsete: the speeds that lead to a moving reference, with its Lyapunov "
       "function (8.8, Theorem 8.8.2)",
       {pose, reference, v, omega, or_number(number("b", "rad²/m²", "how hard it converges"), 2.0),
        or_number(number("zeta", "1/rad", "how much it damps"), 0.7)},
       {number("v", "m/s", "ahead"), number("omega", "rad/s", "turning"),
        list("pose_error", "3", "", "in the robot's frame: ahead (m), left (m), heading (rad)"),
        number("V", "rad²", "b(e_x² + e_y²)/2 + e_θ²/2"), number("V_rate", "rad²/s", "dV/dt")},
       R"({"pose": [0, 0.2, 0], "reference": [0.1, 0, 0.1], "v": 1.5, "omega": 0.3})",
       &solve_ramsete},
      {"ltv-unicycle",
       "the gain of the linear time-varying unicycle at a velocity: [v; ω] = K e + reference (8.9)",
       {K_v, ahead, across, heading, speed, turning, T},
       {matrix("K", "2", "3", "of the error in the robot's frame")},
       R"({"v": 1.5})",
       &solve_ltv_unicycle},
      {"ltv-differential-drive",
       "the gain of the linear time-varying differential drive at a velocity: voltages of the "
       "whole state (8.7.5, Theorem 8.7.4)",
       {number("kV", "V s/m", "straight on"), number("kA", "V s²/m", "straight on"),
        number("kV_angular", "V s/m", "turning, of a wheel's way"),
        number("kA_angular", "V s²/m", "turning, of a wheel's way"),
        number("trackwidth", "m", "between left and right wheels"), K_v, ahead, across, heading,
        tolerance("velocity_tolerance", "m/s", 0.95, "Bryson's, of a side"),
        tolerance("voltage_tolerance", "V", 12.0, "Bryson's, of a side"), T},
       {matrix("K", "2", "5", "of the error [x, y, θ, left, right] in the robot's frame"),
        matrix("A", "5", "5", "of the error, continuous (8.14)"),
        matrix("B", "5", "2", "of the error, continuous (8.15)")},
       R"({"kV": 3.02, "kA": 0.642, "kV_angular": 1.382, "kA_angular": 0.08495, "trackwidth": 0.9, "v": 1.5})",
       &solve_ltv_drive},
      {"holonomic-follower",
       "the gains of a follower that moves in any direction, and a period of it (8.6)",
       {pose, reference, v, vy, omega, tolerance("x_tolerance", "m", 0.05, "Bryson's"),
        tolerance("y_tolerance", "m", 0.05, "Bryson's"),
        tolerance("heading_tolerance", "rad", 0.1, "Bryson's"),
        tolerance("velocity_tolerance", "m/s", 0.5, "Bryson's, of the velocity"),
        tolerance("angular_velocity_tolerance", "rad/s", 1.0, "Bryson's, of the turning"), T},
       {list("gains", "3", "1/s", "of x, y and the heading"),
        number("vx", "m/s", "ahead, in the robot's frame"), number("vy", "m/s", "to the left"),
        number("omega", "rad/s", "turning")},
       R"({"pose": [0, 0.2, 0], "reference": [0.1, 0, 0.1], "v": 1.5, "omega": 0.3})",
       &solve_holonomic},
      {"pure-pursuit",
       "a period of pure pursuit: the arc that leads to the point of a path one lookahead on "
       "(8.8)",
       {pose, matrix("path", "P", "3", "a row a point: x (m), y (m), heading (rad)"),
        number("lookahead", "m", "how far it looks ahead along the path"),
        number("v", "m/s", "the velocity along the path"),
        or_number(number("tolerance", "m", "so near the end it has arrived"), 0.02)},
       {number("v", "m/s", "ahead"), number("omega", "rad/s", "turning"),
        number("curvature", "1/m", "of the arc"),
        list("target", "2", "m", "the point that is pursued"),
        number("cross_track", "m", "from the path, positive to its left"),
        number("progress", "m", "of the path that is done"),
        flag("arrived", "whether it is at the path's end")},
       R"({"pose": [0, 0.2, 0], "path": [[0, 0, 0], [1, 0, 0], [2, 0.5, 0.5]], "lookahead": 0.5, "v": 1})",
       &solve_pure_pursuit},
  };
}

}  // namespace flyball::solve
