// Pictures of the fastest trajectories.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "study/answer/drawing.hpp"
#include "study/answer/optimize_parts.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;

constexpr double gap = std::numeric_limits<double>::quiet_NaN();

struct Outline {
  std::vector<double> x{}, y{};

  void add(const Vector2d& p) {
    x.push_back(p(0));
    y.push_back(p(1));
  }
  void lift() {
    x.push_back(gap);
    y.push_back(gap);
  }
};

template <class Value>
std::vector<double> column(const DriveSolution& solution, Value&& value) {
  std::vector<double> values;
  for (const DriveSample& s : solution.samples) {
    values.push_back(value(s));
  }
  return values;
}

std::vector<double> times(const DriveSolution& solution) {
  return column(solution, [](const DriveSample& s) { return s.time; });
}

/// The robot in its frame, with a notch where it looks.
Outline robot_of(const DriveModel& model) {
  std::vector<Vector2d> corners = model.corners;
  if (corners.empty()) {
    corners = {Vector2d(0.1, 0.1), Vector2d(-0.1, 0.1), Vector2d(-0.1, -0.1), Vector2d(0.1, -0.1)};
  }
  double front = 0.0;
  for (const Vector2d& corner : corners) {
    front = std::max(front, corner(0));
  }
  Outline out;
  for (const Vector2d& corner : corners) {
    out.add(corner);
  }
  out.add(corners.front());
  out.lift();
  out.add(Vector2d(0.6 * front, 0.25 * front));
  out.add(Vector2d(0.95 * front, 0.0));
  out.add(Vector2d(0.6 * front, -0.25 * front));
  return out;
}

Vector2d placed(const DriveSample& s, double x, double y) {
  const double c = std::cos(s.heading);
  const double d = std::sin(s.heading);
  return {s.x + c * x - d * y, s.y + d * x + c * y};
}

void add_disc(Outline& out, double x, double y, double radius) {
  constexpr int corners = 48;
  for (int i = 0; i <= corners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / corners;
    out.add(Vector2d(x + radius * std::cos(angle), y + radius * std::sin(angle)));
  }
  out.lift();
}

/// What areas look like; @param inside  those to stay in.
Outline areas_of(const DriveProblem& problem, bool inside) {
  Outline out;
  for (const DriveConstraint& c : problem.constraints) {
    switch (c.kind) {
      case DriveConstraintKind::keep_out_circle:
      case DriveConstraintKind::keep_in_circle:
        if ((c.kind == DriveConstraintKind::keep_in_circle) == inside) {
          add_disc(out, c.x, c.y, c.radius);
        }
        break;
      case DriveConstraintKind::keep_out_polygon:
      case DriveConstraintKind::keep_in_polygon:
        if ((c.kind == DriveConstraintKind::keep_in_polygon) == inside) {
          for (std::size_t i = 0; i <= c.polygon.size(); ++i) {
            out.add(c.polygon[i % c.polygon.size()]);
          }
          out.lift();
        }
        break;
      case DriveConstraintKind::keep_in_rectangle:
        if (inside) {
          for (const auto& [dx, dy] :
               {std::pair{0.0, 0.0}, std::pair{1.0, 0.0}, std::pair{1.0, 1.0}, std::pair{0.0, 1.0},
                std::pair{0.0, 0.0}}) {
            out.add(Vector2d(c.x + dx * c.width, c.y + dy * c.height));
          }
          out.lift();
        }
        break;
      default:
        break;
    }
  }
  return out;
}

Figure field_figure(const OptimizeTask& task, const DriveSolution& solution, std::size_t number) {
  Figure figure{section_title(number),
                fmt::format("field_{}", number + 1),
                fmt::format("{}: the field from above", task.name),
                "The way of the robot's middle, waypoints, and the areas to stay in and out of; "
                "outlines of the robot stand where it is at even times.",
                {}};
  Plot& plot = figure.plot;
  plot.title = figure.title;
  plot.x_label = "x (m)";
  plot.equal_axes = true;
  PlotPanel panel{.y_label = "y (m)"};
  Outline out = areas_of(task.problem, false);
  if (!out.x.empty()) {
    panel.lines.push_back({.label = "keep out",
                           .x = std::move(out.x),
                           .y = std::move(out.y),
                           .color = voltage_color});
  }
  Outline in = areas_of(task.problem, true);
  if (!in.x.empty()) {
    panel.lines.push_back({.label = "keep in",
                           .x = std::move(in.x),
                           .y = std::move(in.y),
                           .style = LineStyle::guide});
  }
  Outline robots;
  const Outline robot = robot_of(task.problem.model);
  constexpr std::size_t outlines = 9;
  for (std::size_t k = 0; k < outlines; ++k) {
    const double t = solution.duration * static_cast<double>(k) / (outlines - 1);
    const auto at = std::find_if(solution.samples.begin(), solution.samples.end(),
                                 [&](const DriveSample& s) { return s.time >= t - 1e-9; });
    const DriveSample& s = at == solution.samples.end() ? solution.samples.back() : *at;
    for (std::size_t j = 0; j < robot.x.size(); ++j) {
      robots.add(placed(s, robot.x[j], robot.y[j]));
    }
    robots.lift();
  }
  panel.lines.push_back({.label = "robot",
                         .x = std::move(robots.x),
                         .y = std::move(robots.y),
                         .style = LineStyle::dotted,
                         .color = unused_color});
  panel.lines.push_back(line("way", column(solution, [](const DriveSample& s) { return s.x; }),
                             column(solution, [](const DriveSample& s) { return s.y; }),
                             measured_color));
  Outline places;
  for (const DriveWaypoint& w : task.problem.waypoints) {
    if (w.fix_translation) {
      places.add(Vector2d(w.x, w.y));
    }
  }
  panel.lines.push_back({.label = "waypoints",
                         .x = std::move(places.x),
                         .y = std::move(places.y),
                         .style = LineStyle::circles,
                         .color = simulated_color});
  plot.panels = {std::move(panel)};
  return figure;
}

std::string clock_of(std::size_t number) {
  return fmt::format("optimize_{}", number + 1);
}

void mark(const OptimizeTask& task, const DriveSolution& solution, Plot& plot) {
  for (PlotPanel& panel : plot.panels) {
    for (std::size_t i = 1; i + 1 < solution.waypoint_times.size(); ++i) {
      if (task.problem.waypoints[i].fix_translation) {
        panel.marks.push_back({solution.waypoint_times[i], "", true});
      }
    }
  }
}

Figure speeds_figure(const OptimizeTask& task, const DriveSolution& solution, std::size_t number) {
  Figure figure = over_time(section_title(number), fmt::format("speeds_{}", number + 1),
                            fmt::format("{}: speeds", task.name),
                            "Speeds of the robot's middle and of its fastest wheel.");
  figure.plot.clock = clock_of(number);
  const std::vector<double> t = times(solution);
  const DriveModel& model = task.problem.model;
  const auto fastest = column(solution, [&](const DriveSample& s) {
    if (model.drivetrain == Drivetrain::differential) {
      return std::max(std::abs(s.left), std::abs(s.right));
    }
    double most = 0.0;
    const double c = std::cos(s.heading);
    const double d = std::sin(s.heading);
    for (const Vector2d& r : model.wheels) {
      most = std::max(most, std::hypot(s.vx - s.omega * (d * r(0) + c * r(1)),
                                       s.vy + s.omega * (c * r(0) - d * r(1))));
    }
    return most;
  });
  PlotPanel speed =
      panel({"Speed", "m/s"},
            {line("middle", t,
                  column(solution, [](const DriveSample& s) { return std::hypot(s.vx, s.vy); }),
                  measured_color),
             line("fastest wheel", t, fastest, simulated_color, LineStyle::dashed)},
            true);
  speed.marks.push_back({model.max_speed, "limit", false});
  figure.plot.panels = {
      std::move(speed),
      panel({"Turning", "rad/s"},
            {line("", t, column(solution, [](const DriveSample& s) { return s.omega; }),
                  measured_color)},
            true),
      panel({"Heading", "rad"},
            {line("", t, column(solution, [](const DriveSample& s) { return s.heading; }),
                  measured_color)})};
  mark(task, solution, figure.plot);
  return figure;
}

Figure forces_figure(const OptimizeTask& task, const DriveSolution& solution, std::size_t number) {
  Figure figure = over_time(section_title(number), fmt::format("forces_{}", number + 1),
                            fmt::format("{}: forces", task.name),
                            "What each wheel pushes with; forces are held between two points.");
  figure.plot.clock = clock_of(number);
  const DriveModel& model = task.problem.model;
  const std::vector<double> t = times(solution);
  PlotPanel forces = panel({"Force", "N"}, {}, true);
  for (std::size_t i = 0; i < static_cast<std::size_t>(model.wheel_count()); ++i) {
    std::string label = wheel_name(model.drivetrain, i);
    std::replace(label.begin(), label.end(), '_', ' ');
    const auto force = column(solution, [&](const DriveSample& s) {
      return model.drivetrain == Drivetrain::swerve ? s.forces[i].norm() : s.forces[i](0);
    });
    forces.lines.push_back(line(label, t, force, static_cast<int>(i), LineStyle::steps));
  }
  forces.marks.push_back({model.force(), "limit", false});
  if (model.drivetrain != Drivetrain::swerve) {
    forces.marks.push_back({-model.force(), "", false});
  }
  figure.plot.panels = {
      std::move(forces),
      panel({"Acceleration", "m/s²"},
            {line("", t,
                  column(solution, [](const DriveSample& s) { return std::hypot(s.ax, s.ay); }),
                  unused_color, LineStyle::steps)},
            true)};
  mark(task, solution, figure.plot);
  return figure;
}

}  // namespace

std::string section_title(std::size_t number) {
  return fmt::format("trajectory_{}", number + 1);
}

std::string wheel_name(Drivetrain drivetrain, std::size_t wheel) {
  constexpr std::array four{"front_left", "front_right", "back_left", "back_right"};
  constexpr std::array two{"left", "right"};
  return drivetrain == Drivetrain::differential ? two[wheel % 2] : four[wheel % 4];
}

std::vector<Figure> optimize_figures(const OptimizeTask& task, const DriveSolution& solution,
                                     std::size_t number) {
  return {field_figure(task, solution, number), speeds_figure(task, solution, number),
          forces_figure(task, solution, number)};
}

Animation optimize_animation(const OptimizeTask& task, const DriveSolution& solution,
                             std::size_t number) {
  Animation animation{.section = section_title(number),
                      .name = fmt::format("animation_{}", number + 1),
                      .title = "The robot on the field",
                      .description =
                          "The robot along its trajectory. It shows the moment that the "
                          "cursor of the plots below is at, and the other way round.",
                      .clock = clock_of(number),
                      .time = times(solution)};
  for (const bool inside : {true, false}) {
    Outline areas = areas_of(task.problem, inside);
    if (!areas.x.empty()) {
      animation.parts.push_back(
          {.x = std::move(areas.x), .y = std::move(areas.y), .style = PartStyle::ground});
    }
  }
  animation.parts.push_back({.x = column(solution, [](const DriveSample& s) { return s.x; }),
                             .y = column(solution, [](const DriveSample& s) { return s.y; }),
                             .style = PartStyle::ground});
  Outline robot = robot_of(task.problem.model);
  animation.parts.push_back(
      {.label = "robot",
       .x = std::move(robot.x),
       .y = std::move(robot.y),
       .color = measured_color,
       .to_x = column(solution, [](const DriveSample& s) { return s.x; }),
       .to_y = column(solution, [](const DriveSample& s) { return s.y; }),
       .angle = column(solution, [](const DriveSample& s) { return s.heading; })});
  animation.values = {
      {"speed", "m/s",
       column(solution, [](const DriveSample& s) { return std::hypot(s.vx, s.vy); })},
      {"turning", "rad/s", column(solution, [](const DriveSample& s) { return s.omega; })}};
  return animation;
}

}  // namespace flyball::study
