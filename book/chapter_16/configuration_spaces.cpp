#include <array>
#include <numbers>
#include <vector>

#include <flyball/planning/configuration/configuration_space.hpp>
#include <flyball/planning/configuration/path_planner.hpp>

#include "book/figure_functions.hpp"

namespace flyball::book {

namespace {

using std::numbers::pi;

/// An arm on an elevator: how far each may go, whatever the other does.
ConfigurationSpace elevator_arm() {
  return ConfigurationSpace::create(
             {{.name = "arm angle", .unit = "rad", .low = -0.75 * pi, .high = 0.75 * pi},
              {.name = "elevator height", .unit = "m", .low = 0.0, .high = 5.0}})
      .value();
}

/// Near the middle of its travel the arm meets the chassis, unless the elevator is 2 m up.
Expected<void> forbid_chassis(ConfigurationSpace& space) {
  return space.forbid("chassis", Region::box({-0.25 * pi, 0.0}, {0.25 * pi, 2.0}));
}

/// How far down the elevator can go at an angle of the arm.
double lowest(const ConfigurationSpace& space, double angle) {
  const double top = space.axes()[1].high;
  const MoveCheck down = space.check_move(std::array{angle, top}, std::array{0.0, -top});
  return top - down.at * top;
}

/// The outline of the valid states, and the picture of it. @param angles  Where it has corners,
/// and where the elevator's limit is asked for each.
FigureResult space_figure(std::string id, std::string title, const ConfigurationSpace& space,
                          const std::vector<std::array<double, 2>>& corners) {
  FigureResult figure{.id = std::move(id), .title = std::move(title)};
  std::vector<double> angle;
  std::vector<double> height;
  for (const auto& [at, asked] : corners) {
    angle.push_back(at);
    height.push_back(lowest(space, asked));
  }
  const double top = space.axes()[1].high;
  PlotBand valid{.label = "Valid states", .x = angle, .low = height, .color = 2};
  valid.high.assign(angle.size(), top);
  for (const double at : {angle.back(), angle.front(), angle.front()}) {
    angle.push_back(at);
    height.push_back(top);
  }
  height.back() = height.front();
  figure.columns = {{"arm_angle", "rad", angle}, {"elevator_height", "m", height}};
  Plot plot{.title = figure.title, .x_label = "Arm angle (rad)"};
  PlotPanel panel{.y_label = "Elevator height (m)"};
  panel.bands.push_back(std::move(valid));
  panel.lines.push_back({.label = "Limits", .x = angle, .y = height, .color = 6});
  panel.y_limits = PlotLimits{-1.0, 6.5};
  plot.panels.push_back(std::move(panel));
  figure.picture = std::move(plot);
  return figure;
}

/// Corners of Figures 16.2 to 16.4: beside the chassis and over it.
const std::vector<std::array<double, 2>>& dependent_corners() {
  static const std::vector<std::array<double, 2>> corners{
      {-0.75 * pi, -0.75 * pi}, {-0.25 * pi, -0.5 * pi}, {-0.25 * pi, 0.0},
      {0.25 * pi, 0.0},         {0.25 * pi, 0.5 * pi},   {0.75 * pi, 0.75 * pi}};
  return corners;
}

/// A point with its name, as numbers and in the picture.
void add_point(FigureResult& figure, const std::string& name, const std::vector<double>& q) {
  figure.numbers.push_back({name + "_angle", "rad", q[0]});
  figure.numbers.push_back({name + "_height", "m", q[1]});
  PlotPanel& panel = std::get<Plot>(figure.picture).panels[0];
  panel.lines.push_back(
      {.label = "", .x = {q[0]}, .y = {q[1]}, .style = LineStyle::circles, .color = 1});
  panel.notes.push_back({q[0], q[1], name});
}

const std::vector<double> x{-1.0, 0.5};
const std::vector<double> goal_state{1.0, 0.5};

}  // namespace

/// Figure 16.1: limits that do not depend on each other (section 16.2).
FigureResult figure_16_1() {
  return space_figure("16.1", "Configuration space with independent constraints", elevator_arm(),
                      {{-0.75 * pi, -0.75 * pi}, {0.75 * pi, 0.75 * pi}});
}

/// Figure 16.2: pointing down, the arm needs the elevator above a height.
FigureResult figure_16_2() {
  ConfigurationSpace space = elevator_arm();
  static_cast<void>(forbid_chassis(space));
  return space_figure("16.2", "Configuration space with dependent constraints", space,
                      dependent_corners());
}

/// Figure 16.3: the same with where it is, x, and where it is to be, r.
FigureResult figure_16_3() {
  FigureResult figure = figure_16_2();
  figure.id = "16.3";
  figure.title = "Configuration space with initial state x and goal state r";
  std::get<Plot>(figure.picture).title = figure.title;
  add_point(figure, "x", x);
  add_point(figure, "r", goal_state);
  return figure;
}

/// Figure 16.4: the shortest path from x to r, by the waypoints a and b.
FigureResult figure_16_4() {
  ConfigurationSpace space = elevator_arm();
  static_cast<void>(forbid_chassis(space));
  const ConfigurationPath path = plan_path(space, x, goal_state).value();
  FigureResult figure = figure_16_2();
  figure.id = "16.4";
  figure.title = "Configuration space with a path from x to r";
  std::get<Plot>(figure.picture).title = figure.title;
  PlotLine line{.label = "Path", .color = 0};
  const std::array<const char*, 4> names{"x", "a", "b", "r"};
  for (std::size_t i = 0; i < path.waypoints.size() && i < names.size(); ++i) {
    add_point(figure, names[i], path.waypoints[i]);
    line.x.push_back(path.waypoints[i][0]);
    line.y.push_back(path.waypoints[i][1]);
  }
  std::get<Plot>(figure.picture).panels[0].lines.push_back(std::move(line));
  return figure;
}

}  // namespace flyball::book
