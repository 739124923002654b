#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/LU>

#include <flyball/math/integration/fixed_step.hpp>
#include <flyball/planning/trajectory/trajectory.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/linearize.hpp>

#include "book/chapter_8/followed_trajectory.hpp"

namespace flyball::book {

using namespace flyball::literals;

namespace {

/// From (1.330117 m, 13 m) to (10.17 m, 18 m), along x at both ends, at most 3.5 m/s and 3.5 m/s².
Trajectory followed_reference() {
  const std::vector<Pose2d> waypoints{{1.330117, 13.0, 0.0}, {10.17, 18.0, 0.0}};
  const auto path = sample_path(quintic_spline(waypoints).value()).value();
  return time_path(path, {.velocity = 3.5, .acceleration = 3.5}).value();
}

/// The state along it. Between two points of the path the book's tool moves position and heading in
/// proportion, where `Trajectory` goes along an arc: up to 1.3e-3 of the figures' values apart.
DriveVector reference_at(const Trajectory& trajectory, double t) {
  const TrajectoryPoint point = trajectory.sample(t);
  const auto& points = trajectory.points();
  const auto next = std::ranges::upper_bound(points, t, {}, &TrajectoryPoint::time);
  Pose2d pose = point.pose;
  if (next != points.begin() && next != points.end()) {
    const auto& [from, to] = std::pair(*(next - 1), *next);
    const double dt = t - from.time;
    const double share = (from.velocity * dt + 0.5 * from.acceleration * dt * dt) /
                         (to.pose.translation() - from.pose.translation()).norm();
    const double turn = to.pose.rotation().minus(from.pose.rotation())(0);
    pose =
        Pose2d(from.pose.translation() + share * (to.pose.translation() - from.pose.translation()),
               Rotation2d(from.pose.angle() + share * turn));
  }
  const DriveState state = drive_state(
      tracking_point({.velocity = point.velocity, .pose = pose, .curvature = point.curvature}),
      drive_trackwidth.si());
  return DriveVector{state.pose.x(), state.pose.y(), state.pose.angle(), state.left, state.right};
}

const std::vector<StateLabel>& labels() {
  static const std::vector<StateLabel> all{{"x", "m", "x position"},
                                           {"y", "m", "y position"},
                                           {"heading", "rad", "Heading"},
                                           {"left_velocity", "m/s", "Left velocity"},
                                           {"right_velocity", "m/s", "Right velocity"}};
  return all;
}

}  // namespace

mechanisms::DifferentialDrive case_study_drive() {
  return mechanisms::differential_drive({.motor = mechanisms::cim(3),
                                         .left_gearing = 60.0 / 11.0,
                                         .right_gearing = 60.0 / 11.0,
                                         .mass = 52_kg,
                                         .wheel_radius = 0.041275_m,
                                         .trackwidth = drive_trackwidth,
                                         .moment_of_inertia = 6_kg_m2})
      .value();
}

FollowedTrajectory follow(const DriveFeedback& feedback, DriveMotion motion) {
  const FieldDrive model;
  const Trajectory trajectory = followed_reference();
  const double period = drive_period.si();
  const auto samples = static_cast<Eigen::Index>(std::ceil(trajectory.total_time() / period));
  FollowedTrajectory run{Eigen::MatrixXd(5, samples), Eigen::MatrixXd(5, samples),
                         Eigen::MatrixXd(2, samples)};
  for (Eigen::Index k = 0; k < samples; ++k) {
    run.r.col(k) = reference_at(trajectory, static_cast<double>(k) * period);
  }
  const Eigen::Matrix2d B_inverse = model.drive.B.inverse();
  DriveVector x{run.r(0, 0) + 0.5, run.r(1, 0) + 0.5, std::numbers::pi / 2.0, 0.0, 0.0};
  Eigen::Vector2d u = Eigen::Vector2d::Zero();
  for (Eigen::Index k = 0; k < samples; ++k) {
    if (k > 0) {
      if (motion == DriveMotion::first_order) {
        const auto linear = linearize(model, x, u).value();
        const auto sampled = discretize_zoh(linear.A, linear.B, drive_period).value();
        x = (sampled.A * x + sampled.B * u).eval();
      } else {
        constexpr int steps = 4;  // each 5 ms: the integration's error is that of rounding
        for (int i = 0; i < steps; ++i) {
          x = runge_kutta_step(
              tableaus::dormand_prince,
              [&](double, const DriveVector& at) { return model.derivative(at, u); }, 0.0, x,
              period / steps);
        }
      }
    }
    const DriveVector r = run.r.col(k);
    const Eigen::Vector2d v = r.tail<2>();
    const Eigen::Vector2d v_next = run.r.col(std::min(k + 1, samples - 1)).tail<2>();
    // u_ff = B⁺((r_{k+1} - r_k)/T - f(r_k, 0)); the battery has 12 V.
    const Eigen::Vector2d u_ff = B_inverse * ((v_next - v) / period - model.drive.A * v);
    bool saturated = false;
    u = within_voltage(feedback(x, r) + u_ff, 12.0, saturated);
    run.x.col(k) = x;
    run.u.col(k) = u;
  }
  return run;
}

void add_run(FigureResult& figure, const FollowedTrajectory& run, const std::string& suffix) {
  const Eigen::Index samples = run.x.cols();
  if (figure.columns.empty()) {
    figure.columns.push_back({"time", "s",
                              values(Eigen::VectorXd::LinSpaced(
                                  samples, 0.0, drive_period.si() * double(samples - 1)))});
    for (std::size_t i = 0; i < labels().size(); ++i) {
      figure.columns.push_back({"reference_" + labels()[i].name, labels()[i].unit,
                                values(run.r.row(static_cast<Eigen::Index>(i)))});
    }
  }
  for (std::size_t i = 0; i < labels().size(); ++i) {
    figure.columns.push_back({labels()[i].name + suffix, labels()[i].unit,
                              values(run.x.row(static_cast<Eigen::Index>(i)))});
  }
  figure.columns.push_back({"left_voltage" + suffix, "V", values(run.u.row(0))});
  figure.columns.push_back({"right_voltage" + suffix, "V", values(run.u.row(1))});
}

Plot path_plot(const FigureResult& figure) {
  const auto column = [&](const std::string& name) {
    return std::ranges::find(figure.columns, name, &TimeSeries::Column::name)->values;
  };
  Plot plot{.title = figure.title, .x_label = "x position (m)", .equal_axes = true};
  PlotPanel panel{.y_label = "y position (m)"};
  panel.lines = {{"Reference", column("reference_x"), column("reference_y"), LineStyle::dashed,
                  reference_color},
                 {"State", column("x"), column("y"), LineStyle::solid, state_color}};
  plot.panels = {panel};
  return plot;
}

Plot drive_response_plot(const FigureResult& figure) {
  std::vector<ResponsePanel> panels;
  for (const auto& [name, unit, label] : labels()) {
    panels.push_back({label + " (" + unit + ")", name});
  }
  panels.push_back({"Left voltage (V)", "left_voltage", "Input"});
  panels.push_back({"Right voltage (V)", "right_voltage", "Input"});
  return response_plot(figure, panels);
}

FigureResult path_figure(std::string id, std::string title, const FollowedTrajectory& run) {
  FigureResult figure{.id = std::move(id), .title = std::move(title)};
  add_run(figure, run);
  figure.picture = path_plot(figure);
  return figure;
}

FigureResult response_figure(std::string id, std::string title, const FollowedTrajectory& run) {
  FigureResult figure{.id = std::move(id), .title = std::move(title)};
  add_run(figure, run);
  figure.picture = drive_response_plot(figure);
  return figure;
}

}  // namespace flyball::book
