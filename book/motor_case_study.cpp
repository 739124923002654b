#include <algorithm>
#include <cmath>

#include "book/motor_case_study.hpp"

namespace flyball::book {

ContinuousSystem<2, 1, 1> case_study_motor() {
  constexpr double J = 7.75e-5;
  constexpr double b = 8.91e-5;
  constexpr double K_t = 0.0184;
  constexpr double K_e = 0.0211;
  constexpr double R = 0.0916;
  constexpr double L = 5.9e-5;
  return {Eigen::Matrix2d{{-b / J, K_t / J}, {-K_e / L, -R / L}}, Eigen::Vector2d(0.0, 1.0 / L),
          Eigen::RowVector2d(1.0, 0.0), Eigen::Matrix<double, 1, 1>(0.0)};
}

Eigen::Vector2d case_study_reference() {
  return {2000.0 * 0.1047, 0.0};
}

FigureResult case_study(std::string id, std::string title, const DiscreteSystem<2, 1, 1>& plant,
                        const std::vector<CaseStudy>& controllers) {
  const Eigen::Vector2d r = case_study_reference();
  const int samples = static_cast<int>(std::lround(0.025 / plant.period.si()));
  std::vector<double> time;
  for (int k = 0; k < samples; ++k) {
    time.push_back(k * plant.period.si());
  }
  const auto constant = [&](double value) { return std::vector<double>(time.size(), value); };
  FigureResult figure{.id = std::move(id), .title = std::move(title)};
  figure.columns = {{"time", "s", time},
                    {"reference_velocity", "rad/s", constant(r(0))},
                    {"reference_current", "A", constant(r(1))}};
  Plot plot{.title = figure.title, .x_label = "Time (s)"};
  plot.panels = {{.y_label = "Angular velocity (rad/s)"},
                 {.y_label = "Current (A)"},
                 {.y_label = "Voltage (V)"}};
  for (std::size_t i = 0; i < 2; ++i) {
    plot.panels[i].lines.push_back({.label = i == 0 ? "Reference" : "",
                                    .x = time,
                                    .y = constant(r(static_cast<Eigen::Index>(i))),
                                    .style = LineStyle::dashed,
                                    .color = 1});
  }
  // Blue, green, black, told apart in grey by their dashes.
  constexpr int colors[] = {0, 2, 6};
  constexpr LineStyle styles[] = {LineStyle::solid, LineStyle::dash_dot, LineStyle::dotted};
  std::size_t drawn = 0;
  for (const CaseStudy& controller : controllers) {
    Eigen::Vector2d x = Eigen::Vector2d::Zero();
    std::vector<double> columns[3];
    for (int k = 0; k < samples; ++k) {
      const double u = std::clamp(controller.K.dot(r - x) + controller.u_ff, -12.0, 12.0);
      x = plant.A * x + plant.B * u;
      columns[0].push_back(x(0));
      columns[1].push_back(x(1));
      columns[2].push_back(u);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      plot.panels[i].lines.push_back({.label = i == 0 ? controller.label : "",
                                      .x = time,
                                      .y = columns[i],
                                      .style = styles[drawn % 3],
                                      .color = colors[drawn % 3]});
    }
    ++drawn;
    figure.columns.push_back({"velocity_" + controller.name, "rad/s", columns[0]});
    figure.columns.push_back({"current_" + controller.name, "A", columns[1]});
    figure.columns.push_back({"voltage_" + controller.name, "V", columns[2]});
  }
  figure.picture = std::move(plot);
  return figure;
}

}  // namespace flyball::book
