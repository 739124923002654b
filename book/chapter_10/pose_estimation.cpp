#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/LU>

#include <flyball/estimation/odometry.hpp>
#include <flyball/math/integration/fixed_step.hpp>
#include <flyball/mechanisms/differential_drive.hpp>
#include <flyball/mechanisms/kinematics/wheel_kinematics.hpp>
#include <flyball/planning/trajectory/trajectory.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

/// Figures 10.1 to 10.4: a differential drive follows a spline by feedforward alone, and two
/// odometries add up its motion every 20 ms (section 10.2.4).
namespace flyball::book {

using namespace flyball::literals;

namespace {

using Wheels = Eigen::Vector2d;
/// x, y, heading, the sides' velocities, the sides' distances.
using State = Eigen::Vector<double, 7>;

constexpr double period = 0.02;
constexpr Length trackwidth = 0.59055_m;

/// What the figures show: the pose that is, and those of the odometries.
struct Drive {
  std::vector<double> time{};
  std::vector<Pose2d> exact{};
  std::vector<Pose2d> euler{};
  std::vector<Pose2d> exponential{};
  Trajectory reference;
};

Trajectory reference_trajectory() {
  const std::vector<Pose2d> waypoints{{1.330117, 13.0, 0.0}, {10.17, 18.0, 0.0}};
  const auto path = sample_path(quintic_spline(waypoints).value()).value();
  return time_path(path, {.velocity = 3.5, .acceleration = 3.5}).value();
}

Drive follow_by_feedforward() {
  const auto drive = mechanisms::differential_drive({.motor = mechanisms::cim(3),
                                                     .left_gearing = 60.0 / 11.0,
                                                     .right_gearing = 60.0 / 11.0,
                                                     .mass = 52_kg,
                                                     .wheel_radius = 0.041275_m,
                                                     .trackwidth = trackwidth,
                                                     .moment_of_inertia = 6_kg_m2})
                         .value();
  const auto kinematics = mechanisms::differential_kinematics(trackwidth).value();
  Drive result{.reference = reference_trajectory()};
  const Trajectory& trajectory = result.reference;
  // The wheels' speeds along the path: v and ω = v κ.
  const auto wheels_at = [&](double t) -> Wheels {
    const TrajectoryPoint point = trajectory.sample(t);
    return kinematics.wheels({point.velocity, 0.0, point.velocity * point.curvature});
  };

  const Pose2d start = trajectory.points().front().pose;
  State x = State::Zero();
  x.head<3>() << start.x(), start.y(), start.angle();
  Odometry euler(OdometryRule::forward_euler, start);
  Odometry exponential(OdometryRule::pose_exponential, start);
  for (int k = 0; k * period < trajectory.total_time(); ++k) {
    const double t = k * period;
    if (k > 0) {
      // Plant inversion: u = B⁻¹((r_{k+1} - r_k)/T - A r_k), within the battery's voltage.
      const Wheels r = wheels_at(t - period);
      Wheels u = drive.B.lu().solve((wheels_at(t) - r) / period - drive.A * r);
      u *= std::min(1.0, 12.0 / u.cwiseAbs().maxCoeff());
      const auto motion = [&](double, const State& at) {
        const Wheels v = at.segment<2>(3);
        const auto robot = kinematics.chassis(v);
        State rate;
        rate << robot.vx * std::cos(at(2)), robot.vx * std::sin(at(2)), robot.omega,
            drive.derivative(v, u), v;
        return rate;
      };
      const Wheels before = x.tail<2>();
      x = runge_kutta_step(tableaus::dormand_prince, motion, 0.0, x, period);
      euler.step(kinematics.twist(x.segment<2>(3) * period));
      exponential.step(kinematics.twist(x.tail<2>() - before), Rotation2d(x(2)));
    }
    result.time.push_back(t);
    result.exact.emplace_back(x(0), x(1), x(2));
    result.euler.push_back(euler.pose());
    result.exponential.push_back(exponential.pose());
  }
  return result;
}

template <class F>
std::vector<double> each(const std::vector<Pose2d>& poses, F&& value) {
  std::vector<double> all;
  all.reserve(poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    all.push_back(value(poses[k], k));
  }
  return all;
}

/// The largest of a series, with its sign.
double largest(const std::vector<double>& values) {
  return *std::ranges::max_element(values, {}, [](double value) { return std::abs(value); });
}

/// How far an odometry's coordinate is off, over time.
template <class Error>
FigureResult error_figure(std::string id, const std::string& what, const std::string& unit,
                          Error error) {
  const Drive drive = follow_by_feedforward();
  const auto against_exact = [&](const Pose2d& pose, std::size_t k) {
    return error(pose, drive.exact[k]);
  };
  FigureResult figure{.id = std::move(id), .title = "Pose estimation: error of " + what};
  figure.columns = {{"time", "s", drive.time},
                    {"error_euler", unit, each(drive.euler, against_exact)},
                    {"error_exponential", unit, each(drive.exponential, against_exact)}};
  figure.numbers = {{"largest_error_euler", unit, largest(figure.columns[1].values)}};
  figure.picture =
      line_plot(figure, "Error of " + what + " (" + unit + ")",
                {{"error_euler", "Forward Euler"}, {"error_exponential", "Pose exponential"}});
  return figure;
}

}  // namespace

FigureResult figure_10_1() {
  const Drive drive = follow_by_feedforward();
  const auto x = [](const Pose2d& pose, std::size_t) { return pose.x(); };
  const auto y = [](const Pose2d& pose, std::size_t) { return pose.y(); };
  FigureResult figure{.id = "10.1", .title = "Pose estimation: paths"};
  figure.columns = {{"time", "s", drive.time},
                    {"x_exact", "m", each(drive.exact, x)},
                    {"y_exact", "m", each(drive.exact, y)},
                    {"x_euler", "m", each(drive.euler, x)},
                    {"y_euler", "m", each(drive.euler, y)},
                    {"x_exponential", "m", each(drive.exponential, x)},
                    {"y_exponential", "m", each(drive.exponential, y)}};
  figure.numbers = {{"trajectory_time", "s", drive.reference.total_time()},
                    {"trajectory_points", "", double(drive.reference.points().size())}};
  Plot plot{.title = figure.title, .x_label = "x position (m)", .equal_axes = true};
  PlotPanel panel{.y_label = "y position (m)"};
  panel.lines = {
      {"Exact", figure.columns[1].values, figure.columns[2].values},
      {"Forward Euler", figure.columns[3].values, figure.columns[4].values, LineStyle::dashed},
      {"Pose exponential", figure.columns[5].values, figure.columns[6].values, LineStyle::dotted}};
  plot.panels = {panel};
  figure.picture = std::move(plot);
  return figure;
}

FigureResult figure_10_2() {
  return error_figure("10.2", "x", "cm", [](const Pose2d& pose, const Pose2d& exact) {
    return 100.0 * (pose.x() - exact.x());
  });
}

FigureResult figure_10_3() {
  return error_figure("10.3", "y", "cm", [](const Pose2d& pose, const Pose2d& exact) {
    return 100.0 * (pose.y() - exact.y());
  });
}

FigureResult figure_10_4() {
  return error_figure("10.4", "the heading", "°", [](const Pose2d& pose, const Pose2d& exact) {
    return 180.0 / std::numbers::pi * pose.rotation().minus(exact.rotation())(0);
  });
}

}  // namespace flyball::book
