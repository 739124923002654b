// Pictures of a path: the field, speeds, accelerations and bends over time, the robot on its way.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "study/answer/drawing.hpp"
#include "study/answer/path_parts.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;

constexpr const char* clock_name = "time";

std::vector<double> times_of(const PathResult& result) {
  std::vector<double> time;
  for (const MotionSample& sample : result.trajectory.samples) {
    time.push_back(sample.time);
  }
  return time;
}

template <class Get>
std::vector<double> each(const PathResult& result, const Get& get) {
  std::vector<double> values;
  for (const MotionSample& sample : result.trajectory.samples) {
    values.push_back(get(sample));
  }
  return values;
}

/// m; half of the robot's sides with bumpers.
Vector2d half_size(const PathResult& result) {
  return result.robot ? Vector2d(0.5 * result.robot->length, 0.5 * result.robot->width)
                      : Vector2d(0.4, 0.4);
}

/// The robot's outline in its frame, with a notch where it looks.
std::pair<std::vector<double>, std::vector<double>> outline_of(const PathResult& result) {
  const double x = half_size(result)(0);
  const double y = half_size(result)(1);
  return {{-x, 0.75 * x, x, 0.75 * x, -x, -x}, {-y, -y, 0.0, y, y, -y}};
}

/// The walls, or the edges of where it moves.
std::pair<std::vector<double>, std::vector<double>> edges_of(const PathResult& result) {
  double left = std::numeric_limits<double>::infinity();
  double right = -left;
  double bottom = left;
  double top = -left;
  for (const MotionSample& sample : result.trajectory.samples) {
    left = std::min(left, sample.pose.x());
    right = std::max(right, sample.pose.x());
    bottom = std::min(bottom, sample.pose.y());
    top = std::max(top, sample.pose.y());
  }
  const double length = result.job.field_length.si();
  const double width = result.job.field_width.si();
  const bool on_field = left >= 0.0 && bottom >= 0.0 && right <= length && top <= width;
  const double room = 1.2 * half_size(result).maxCoeff();
  const double x0 = on_field ? 0.0 : left - room;
  const double x1 = on_field ? length : right + room;
  const double y0 = on_field ? 0.0 : bottom - room;
  const double y1 = on_field ? width : top + room;
  return {{x0, x1, x1, x0, x0}, {y0, y0, y1, y1, y0}};
}

Figure field_figure(const PathResult& result) {
  Figure figure{"field",
                "field",
                "The field from above",
                "The way of the robot's middle; outlines of the robot stand at even times, with a "
                "point where it looks.",
                {}};
  Plot& plot = figure.plot;
  plot.title = figure.title;
  plot.x_label = "x (m)";
  plot.equal_axes = true;
  PlotPanel panel{.y_label = "y (m)"};
  auto [wall_x, wall_y] = edges_of(result);
  panel.lines.push_back({.x = std::move(wall_x), .y = std::move(wall_y), .color = unused_color});
  panel.lines.push_back({.label = "path",
                         .x = each(result, [](const MotionSample& s) { return s.pose.x(); }),
                         .y = each(result, [](const MotionSample& s) { return s.pose.y(); }),
                         .color = measured_color});
  // Some outlines, as one line that lifts its pen.
  PlotLine robots{.label = "robot", .color = quiet_color};
  const auto [x, y] = outline_of(result);
  constexpr int shown = 8;
  for (int k = 0; k <= shown; ++k) {
    const Pose2d pose = result.trajectory.at(result.trajectory.duration() * k / shown).pose;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const Vector2d at = pose * Vector2d(x[i], y[i]);
      robots.x.push_back(at(0));
      robots.y.push_back(at(1));
    }
    robots.x.push_back(NAN);
    robots.y.push_back(NAN);
  }
  panel.lines.push_back(std::move(robots));
  plot.panels.push_back(std::move(panel));
  return figure;
}

Figure motion_figure(const PathResult& result) {
  Figure figure = over_time("motion", "motion", "Speed, turning and bend",
                            "The speed along the path, how fast the robot turns, and how the path "
                            "bends.");
  figure.plot.clock = clock_name;
  const std::vector<double> time = times_of(result);
  PlotPanel speed = panel(
      {"Speed", "m/s"},
      {line("speed", time, each(result, [](const MotionSample& s) { return s.velocity.norm(); }),
            measured_color)});
  if (!result.fastest_wheel.empty()) {
    speed.lines.push_back(
        line("fastest wheel", time, result.fastest_wheel, simulated_color, LineStyle::dashed));
    speed.marks.push_back({result.wheel_limit, "wheels without load"});
  }
  figure.plot.panels.push_back(std::move(speed));
  figure.plot.panels.push_back(
      panel({"Turning rate", "rad/s"},
            {line("turning rate", time, each(result, [](const MotionSample& s) { return s.omega; }),
                  voltage_color)},
            true));
  std::vector<double> bend = each(result, [](const MotionSample& s) {
    const double v = s.velocity.norm();
    constexpr double moving = 0.02;  // m/s
    return v > moving ? (s.velocity(0) * s.acceleration(1) - s.velocity(1) * s.acceleration(0)) /
                            (v * v * v)
                      : NAN;
  });
  figure.plot.panels.push_back(
      panel({"Curvature", "1/m"}, {line("curvature", time, bend, quiet_color)}, true));
  return figure;
}

Figure acceleration_figure(const PathResult& result) {
  Figure figure = over_time("motion", "acceleration", "Accelerations",
                            "Along the path and across it, and what turns the robot.");
  figure.plot.clock = clock_name;
  const std::vector<double> time = times_of(result);
  // At rest the direction is that of the nearest sample that moves.
  Vector2d way(1.0, 0.0);
  for (const MotionSample& sample : result.trajectory.samples) {
    if (sample.velocity.norm() > 1e-6) {
      way = sample.velocity.normalized();
      break;
    }
  }
  std::vector<double> along;
  std::vector<double> across;
  for (const MotionSample& sample : result.trajectory.samples) {
    way = sample.velocity.norm() > 1e-6 ? Vector2d(sample.velocity.normalized()) : way;
    along.push_back(sample.acceleration.dot(way));
    across.push_back(way(0) * sample.acceleration(1) - way(1) * sample.acceleration(0));
  }
  figure.plot.panels = {panel({"Acceleration", "m/s²"},
                              {line("along", time, along, measured_color),
                               line("across", time, across, simulated_color, LineStyle::dashed)},
                              true),
                        panel({"Angular acceleration", "rad/s²"},
                              {line("angular acceleration", time,
                                    angular_accelerations(result.trajectory), voltage_color)},
                              true)};
  return figure;
}

Figure place_figure(const PathResult& result) {
  Figure figure =
      over_time("motion", "place", "Place and heading", "Where the robot is over time.");
  figure.plot.clock = clock_name;
  const std::vector<double> time = times_of(result);
  std::vector<double> heading;
  for (const MotionSample& sample : result.trajectory.samples) {
    const double angle = sample.pose.angle();
    heading.push_back(heading.empty() ? angle
                                      : heading.back() + std::remainder(angle - heading.back(),
                                                                        2.0 * std::numbers::pi));
  }
  figure.plot.panels = {
      panel({"Place", "m"},
            {line("x", time, each(result, [](const MotionSample& s) { return s.pose.x(); }),
                  measured_color),
             line("y", time, each(result, [](const MotionSample& s) { return s.pose.y(); }),
                  simulated_color, LineStyle::dashed)}),
      panel({"Heading", "rad"}, {line("heading", time, heading, quiet_color)})};
  return figure;
}

}  // namespace

std::vector<Figure> path_figures(const PathResult& result) {
  return {field_figure(result), motion_figure(result), acceleration_figure(result),
          place_figure(result)};
}

Animation path_animation(const PathResult& result) {
  Animation animation{.section = "field",
                      .name = "drive",
                      .title = "The robot on its way",
                      .description = "The robot from above; the point is where it looks.",
                      .clock = clock_name};
  // Few enough to be smooth: 50 a second, at most 3000.
  const double duration = result.trajectory.duration();
  const auto count = static_cast<std::size_t>(std::clamp(50.0 * duration, 50.0, 3000.0));
  MovingPart robot{.label = "robot", .color = measured_color};
  std::tie(robot.x, robot.y) = outline_of(result);
  TellingValue speed{.label = "speed", .unit = "m/s"};
  TellingValue rate{.label = "turning rate", .unit = "rad/s"};
  double angle = result.trajectory.samples.front().pose.angle();
  for (std::size_t k = 0; k <= count; ++k) {
    const double t = duration * static_cast<double>(k) / static_cast<double>(count);
    const MotionSample sample = result.trajectory.at(t);
    angle += std::remainder(sample.pose.angle() - angle, 2.0 * std::numbers::pi);
    animation.time.push_back(t);
    robot.to_x.push_back(sample.pose.x());
    robot.to_y.push_back(sample.pose.y());
    robot.angle.push_back(angle);
    speed.values.push_back(sample.velocity.norm());
    rate.values.push_back(sample.omega);
  }
  MovingPart walls{.style = PartStyle::ground, .color = unused_color};
  std::tie(walls.x, walls.y) = edges_of(result);
  MovingPart path{.label = "path",
                  .x = each(result, [](const MotionSample& s) { return s.pose.x(); }),
                  .y = each(result, [](const MotionSample& s) { return s.pose.y(); }),
                  .style = PartStyle::ground,
                  .color = quiet_color};
  // The pen goes back along the path, so that no line closes it.
  path.x.push_back(NAN);
  path.y.push_back(NAN);
  animation.parts = {std::move(walls), std::move(path), std::move(robot)};
  animation.values = {std::move(speed), std::move(rate)};
  return animation;
}

}  // namespace flyball::study
