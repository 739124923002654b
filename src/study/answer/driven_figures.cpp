// Pictures of a drivetrain that follows a trajectory.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/driven_parts.hpp"

namespace flyball::study {

namespace {

// A game's field, wall to wall; drawn where the motion is within it.
constexpr double field_length = 17.548;  // m
constexpr double field_width = 8.052;    // m

/// What is shown of the floor.
struct Area {
  double left = std::numeric_limits<double>::infinity();
  double right = -left;
  double bottom = left;
  double top = -left;

  void take(const std::vector<double>& x, const std::vector<double>& y) {
    for (std::size_t i = 0; i < x.size(); ++i) {
      left = std::min(left, x[i]);
      right = std::max(right, x[i]);
      bottom = std::min(bottom, y[i]);
      top = std::max(top, y[i]);
    }
  }
};

const std::vector<double>& column(const DriveResult& result, const std::string& name) {
  static const std::vector<double> none;
  const auto* values = result.series.find(name);
  return values != nullptr ? *values : none;
}

/// The walls of the field, or the edges of the area in which the robot moves.
std::pair<std::vector<double>, std::vector<double>> edges_of(const DriveResult& result) {
  Area area;
  area.take(column(result, "x"), column(result, "y"));
  area.take(column(result, "reference_x"), column(result, "reference_y"));
  const bool on_field = area.left >= 0.0 && area.bottom >= 0.0 && area.right <= field_length &&
                        area.top <= field_width;
  const double room = 0.6 * std::max(result.job.robot.length, result.job.robot.width);
  const double x0 = on_field ? 0.0 : area.left - room;
  const double x1 = on_field ? field_length : area.right + room;
  const double y0 = on_field ? 0.0 : area.bottom - room;
  const double y1 = on_field ? field_width : area.top + room;
  return {{x0, x1, x1, x0, x0}, {y0, y0, y1, y1, y0}};
}

/// The robot's outline in its frame, with a notch where it looks.
std::pair<std::vector<double>, std::vector<double>> outline_of(const DriveRobot& robot) {
  const double x = 0.5 * robot.length;
  const double y = 0.5 * robot.width;
  return {{-x, 0.75 * x, x, 0.75 * x, -x, -x}, {-y, -y, 0.0, y, y, -y}};
}

Figure field_figure(const DriveResult& result) {
  Figure figure{"field",
                "field",
                "The field from above",
                "Where the robot was to go and where it went; outlines of it stand where it was at "
                "even times.",
                {}};
  Plot& plot = figure.plot;
  plot.title = figure.title;
  plot.x_label = "x (m)";
  plot.equal_axes = true;
  PlotPanel panel{.y_label = "y (m)"};
  auto [wall_x, wall_y] = edges_of(result);
  panel.lines.push_back({.x = std::move(wall_x), .y = std::move(wall_y), .color = unused_color});
  const std::vector<double>& x = column(result, "x");
  const std::vector<double>& y = column(result, "y");
  const std::vector<double>& heading = column(result, "heading");
  panel.lines.push_back(line("reference", column(result, "reference_x"),
                             column(result, "reference_y"), simulated_color, LineStyle::dashed));
  panel.lines.push_back(line("robot", x, y, measured_color));
  PlotLine robots{.style = LineStyle::guide};
  const auto [frame_x, frame_y] = outline_of(result.job.robot);
  constexpr std::size_t outlines = 9;
  const double gap = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 0; k < outlines && !x.empty(); ++k) {
    const std::size_t i = k * (x.size() - 1) / (outlines - 1);
    const double c = std::cos(heading[i]);
    const double s = std::sin(heading[i]);
    for (std::size_t j = 0; j < frame_x.size(); ++j) {
      robots.x.push_back(x[i] + c * frame_x[j] - s * frame_y[j]);
      robots.y.push_back(y[i] + s * frame_x[j] + c * frame_y[j]);
    }
    robots.x.push_back(gap);
    robots.y.push_back(gap);
  }
  panel.lines.push_back(std::move(robots));
  if (!x.empty()) {
    panel.lines.push_back({.label = "start",
                           .x = {x.front()},
                           .y = {y.front()},
                           .style = LineStyle::circles,
                           .color = measured_color});
  }
  plot.panels = {std::move(panel)};
  return figure;
}

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) {
    value *= factor;
  }
  return values;
}

/// The end of the trajectory, and when what disturbs acts.
void mark(const DriveResult& result, Plot& plot) {
  const DisturbanceSection& off = result.job.disturbance;
  for (PlotPanel& panel : plot.panels) {
    const bool first = &panel == plot.panels.data();
    panel.marks.push_back({result.duration, first ? "end" : "", true});
    if (off.push.si() > 0.0 && off.push_for.si() > 0.0) {
      panel.spans.push_back(
          {off.push_from.si(), off.push_from.si() + off.push_for.si(), first ? "pushed" : ""});
    }
    if (off.slip_grip != 1.0 && off.slip_for.si() > 0.0) {
      panel.spans.push_back({off.slip_from.si(), off.slip_from.si() + off.slip_for.si(),
                             first ? "smooth floor" : ""});
    }
  }
}

Figure errors_figure(const DriveResult& result) {
  Figure figure = over_time("errors", "errors", "Errors",
                            "How far the robot was from where it should be: along the way that the "
                            "reference goes, across it, and its heading.");
  figure.plot.clock = drive_clock;
  const std::vector<double>& t = result.series.time();
  constexpr double degree = std::numbers::pi / 180.0;
  figure.plot.panels = {
      panel({"Along", "cm"},
            {line("", t, scaled(column(result, "error_along"), 100.0), measured_color)}, true),
      panel({"Across", "cm"},
            {line("", t, scaled(column(result, "error_across"), 100.0), measured_color)}, true),
      panel({"Heading", "°"},
            {line("", t, scaled(column(result, "error_heading"), 1.0 / degree), measured_color)},
            true)};
  mark(result, figure.plot);
  return figure;
}

Figure speeds_figure(const DriveResult& result) {
  Figure figure =
      over_time("speeds", "speeds", "Speeds",
                "The robot's speeds in its own frame, and those that the follower wants.");
  figure.plot.clock = drive_clock;
  const std::vector<double>& t = result.series.time();
  const auto pair = [&](const std::string& name, const Coordinate& shown) {
    return panel(
        shown,
        {line("wanted", t, column(result, "wanted_" + name), simulated_color, LineStyle::dashed),
         line("robot", t, column(result, name), measured_color)},
        true);
  };
  figure.plot.panels = {pair("vx", {"Ahead", "m/s"})};
  if (result.job.robot.kind != DriveKind::differential) {
    figure.plot.panels.push_back(pair("vy", {"To the left", "m/s"}));
  }
  figure.plot.panels.push_back(pair("omega", {"Turning", "rad/s"}));
  figure.plot.panels.push_back(
      panel({"Slip", "m/s"}, {line("", t, column(result, "slip"), voltage_color)}));
  mark(result, figure.plot);
  return figure;
}

Figure voltages_figure(const DriveResult& result) {
  Figure figure =
      over_time("voltages", "voltages", "Voltages",
                "What the motors are asked for, within the limits, and what the battery "
                "gives.");
  figure.plot.clock = drive_clock;
  const std::vector<double>& t = result.series.time();
  PlotPanel volts = panel({"Voltage", "V"}, {}, true);
  PlotPanel amperes = panel({"Current", "A"}, {}, true);
  PlotPanel steer = panel({"Steering", "V"}, {}, true);
  int color = 0;
  for (const std::string& name : shaft_names(result.job.robot.kind)) {
    std::string label = name;
    std::replace(label.begin(), label.end(), '_', ' ');
    volts.lines.push_back(
        line(label, t, column(result, name + "_voltage"), color, LineStyle::steps));
    amperes.lines.push_back(line("", t, column(result, name + "_current"), color));
    if (result.series.find(name + "_steer_voltage") != nullptr) {
      steer.lines.push_back(
          line("", t, column(result, name + "_steer_voltage"), color, LineStyle::steps));
    }
    ++color;
  }
  for (const double limit : {result.job.max_voltage, -result.job.max_voltage}) {
    volts.marks.push_back({limit, limit > 0.0 ? "limit" : "", false});
  }
  figure.plot.panels = {std::move(volts), std::move(amperes)};
  if (!steer.lines.empty()) {
    figure.plot.panels.push_back(std::move(steer));
  }
  figure.plot.panels.push_back(
      panel({"Rail", "V"}, {line("", t, column(result, "rail"), voltage_color)}));
  mark(result, figure.plot);
  return figure;
}

/// Headings that go on where they wrap.
std::vector<double> unwrapped(std::vector<double> angles) {
  for (std::size_t i = 1; i < angles.size(); ++i) {
    angles[i] = angles[i - 1] + std::remainder(angles[i] - angles[i - 1], 2.0 * std::numbers::pi);
  }
  return angles;
}

}  // namespace

std::vector<std::string> shaft_names(DriveKind kind) {
  return kind == DriveKind::differential
             ? std::vector<std::string>{"left", "right"}
             : std::vector<std::string>{"front_left", "front_right", "back_left", "back_right"};
}

std::vector<Figure> figures_of(const DriveResult& result) {
  return {field_figure(result), errors_figure(result), speeds_figure(result),
          voltages_figure(result)};
}

std::vector<Animation> animations_of(const DriveResult& result) {
  if (result.series.rows() < 2) {
    return {};
  }
  constexpr std::size_t most_rows = 2000;
  const std::size_t stride = (result.series.rows() + most_rows - 1) / most_rows;
  const auto thinned = [&](const std::vector<double>& values) {
    std::vector<double> some;
    for (std::size_t i = 0; i < values.size(); i += stride) {
      some.push_back(values[i]);
    }
    return some;
  };
  Animation animation{.section = "field",
                      .name = "animation",
                      .title = "The robot on the field",
                      .clock = drive_clock,
                      .time = thinned(result.series.time())};
  auto [wall_x, wall_y] = edges_of(result);
  animation.parts.push_back(
      {.x = std::move(wall_x), .y = std::move(wall_y), .style = PartStyle::ground});
  animation.parts.push_back({.x = column(result, "reference_x"),
                             .y = column(result, "reference_y"),
                             .style = PartStyle::ground});
  const auto [frame_x, frame_y] = outline_of(result.job.robot);
  animation.parts.push_back({.label = "reference",
                             .x = frame_x,
                             .y = frame_y,
                             .style = PartStyle::outlined,
                             .color = simulated_color,
                             .to_x = thinned(column(result, "reference_x")),
                             .to_y = thinned(column(result, "reference_y")),
                             .angle = unwrapped(thinned(column(result, "reference_heading")))});
  animation.parts.push_back({.label = "robot",
                             .x = frame_x,
                             .y = frame_y,
                             .color = measured_color,
                             .to_x = thinned(column(result, "x")),
                             .to_y = thinned(column(result, "y")),
                             .angle = unwrapped(thinned(column(result, "heading")))});
  if (result.job.robot.kind == DriveKind::swerve) {
    // Each module as a bar along its direction, which moves with the robot.
    const std::vector<std::string> names = shaft_names(DriveKind::swerve);
    const double half = 1.5 * result.job.robot.wheel_radius;
    const std::vector<double>& heading = column(result, "heading");
    for (std::size_t m = 0; m < names.size(); ++m) {
      const Eigen::Vector2d& at = result.job.robot.modules[m];
      MovingPart wheel{.x = {-half, half, half, -half, -half},
                       .y = {-0.3 * half, -0.3 * half, 0.3 * half, 0.3 * half, -0.3 * half},
                       .color = voltage_color};
      const std::vector<double>& angle = column(result, names[m] + "_angle");
      for (std::size_t i = 0; i < heading.size(); i += stride) {
        const double c = std::cos(heading[i]);
        const double s = std::sin(heading[i]);
        wheel.to_x.push_back(column(result, "x")[i] + c * at(0) - s * at(1));
        wheel.to_y.push_back(column(result, "y")[i] + s * at(0) + c * at(1));
        wheel.angle.push_back(heading[i] + angle[i]);
      }
      animation.parts.push_back(std::move(wheel));
    }
  }
  animation.values = {{"across", "cm", scaled(thinned(column(result, "error_across")), 100.0)},
                      {"ahead", "m/s", thinned(column(result, "vx"))},
                      {"rail", "V", thinned(column(result, "rail"))}};
  animation.description =
      "The robot on the field, dashed where it should be. It shows the moment that the cursor of "
      "the plots below is at, and the other way round.";
  return {std::move(animation)};
}

}  // namespace flyball::study
