#include <flyball/math/spectra/projection.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

namespace {

PlotLine arrow(std::string label, const Eigen::Vector2d& to, LineStyle style, int color) {
  return {.label = std::move(label),
          .x = {0.0, to(0)},
          .y = {0.0, to(1)},
          .style = style,
          .color = color};
}

}  // namespace

/// Figure E.9: v = 2i + 1.5j in the basis {i + j, i - j}: how much of it points along each (section
/// E.3.1).
FigureResult figure_E_9() {
  const Eigen::Vector2d v(2.0, 1.5);
  const Eigen::Matrix2d basis{{1.0, 1.0}, {1.0, -1.0}};  // as columns
  const Coordinates found = coordinates(basis, v).value();
  const Eigen::Vector2d plus = found.along(0) * basis.col(0).normalized();
  const Eigen::Vector2d minus = found.along(1) * basis.col(1).normalized();

  FigureResult figure{.id = "E.9", .title = "A vector’s coordinates in another basis"};
  figure.columns = {{"x", "", {v(0), plus(0), minus(0)}}, {"y", "", {v(1), plus(1), minus(1)}}};
  figure.numbers = {{"coordinate_plus", "", found.along(0)},
                    {"coordinate_minus", "", found.along(1)}};
  PlotPanel panel{.y_label = "y",
                  .marks = {{.at = 0.0}, {.at = 0.0, .vertical = true}},
                  .notes = {{0.6, 1.05, "1.75√2"}, {-0.25, -0.2, "0.25√2"}}};
  for (const double side : {1.0, -1.0}) {
    panel.lines.push_back({.x = {0.0, 2.0}, .y = {0.0, side * 2.0}, .style = LineStyle::guide});
  }
  panel.lines.push_back(arrow("v = 2i + 1.5j", v, LineStyle::solid, 0));
  panel.lines.push_back(arrow("along i + j", plus, LineStyle::dashed, 1));
  panel.lines.push_back(arrow("along i − j", minus, LineStyle::dash_dot, 2));
  panel.lines.push_back({.x = {plus(0), v(0), minus(0)},
                         .y = {plus(1), v(1), minus(1)},
                         .style = LineStyle::dotted,
                         .color = 6});
  figure.picture = Plot{.title = figure.title,
                        .x_label = "x",
                        .panels = {std::move(panel)},
                        .equal_axes = true,
                        .x_step = 0.5};
  return figure;
}

}  // namespace flyball::book
